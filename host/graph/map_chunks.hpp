// map_chunks: a subgraph run over tiles of pixels x samples, so that tens of millions of rays fit in bounded memory.
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// The picture (batch of n) whose pixels are walked, and how much of it one chunk holds.
struct ChunkDomain {
  int n = 1, height = 0, width = 0, samples = 1;
  int chunk_pixels = 4096, chunk_samples = 64;
  int every = 1;  // only every so manieth chunk is run, to be timed: what others should give means nothing
};

/// What the body gives: a map {1, C, chunk_pixels, 1} whose columns land at the chunk's pixels of an {n, C, h, w} map,
/// added over sample chunks, or with `first` the first number that is not 0; or a total of any shape, added over all
/// chunks (integers modulo 2^32).
struct ChunkOutput {
  Value value;
  bool total = false, first = false;
};

/// The body is called with an inner graph and one whole-map input per value of `inputs`, and again by gradient(), after
/// this call has returned: what it captures must still be there. Ray tensors inside have the shape
/// {1, C, chunk_pixels, chunk_samples}, samples fastest. Ops read the chunk at hand from Launch::chunk and do nothing
/// for pixels or samples beyond it. Sums are added in chunk order: same bits run to run. A state that the body uses is
/// the outer graph's of that name, and has a gradient there; a body that updates one is refused. Rays of pixels or
/// samples beyond a last chunk that is not full are never written: the gradient of a state that rays ask, a net's
/// weights, is refused unless chunk_pixels divides all pixels and chunk_samples all samples. An input whose gradient is
/// summed over rays by an op that knows no chunk (a number that rays are multiplied by) takes such a domain, too.
std::vector<Value> map_chunks(Graph& graph, const ChunkDomain& domain, std::span<const Value> inputs,
                              const std::function<std::vector<ChunkOutput>(Graph&, std::span<const Value>)>& body);

/// Inside a body: the values of a whole map {n, C, h, w} at the chunk's pixels, {1, C, capacity, 1}, zero beyond them.
Value take_pixels(Value whole, int capacity);
/// The transpose: a whole map that is zero but for the chunk's pixels. Outside of a body columns are all pixels.
Value put_pixels(Value columns, const Shape& whole);

}  // namespace clerestory
