#include "host/graph/transfer.hpp"

namespace clerestory {
namespace {

/// Calls `move(byte offset on the device, first element on the host, elements)` for each contiguous run of the view.
template <class Move>
void for_each_run(const TensorView& view, std::size_t size, Move move) {
  const auto item = static_cast<std::size_t>(view.shape.item());
  if (view.stride == view.shape.item() || view.shape.n == 1) return move(view.offset * size, 0, item * view.shape.n);
  for (std::size_t n = 0; n < static_cast<std::size_t>(view.shape.n); ++n)
    move((view.offset + n * static_cast<std::size_t>(view.stride)) * size, n * item, item);
}

template <class T, class U>
void upload_as(Device& device, const TensorView& to, const std::vector<U>& values) {
  const std::vector<T> data(values.begin(), values.end());
  for_each_run(to, sizeof(T), [&](std::size_t at, std::size_t first, std::size_t count) {
    device.write(to.buffer, data.data() + first, count * sizeof(T), at);
  });
}

template <class T, class U>
void download_as(Device& device, const TensorView& from, std::vector<U>& values) {
  std::vector<T> data(static_cast<std::size_t>(from.shape.count()));
  for_each_run(from, sizeof(T), [&](std::size_t at, std::size_t first, std::size_t count) {
    device.read(from.buffer, data.data() + first, count * sizeof(T), at);
  });
  values.assign(data.begin(), data.end());
}

}  // namespace

void upload(Device& device, const TensorView& to, const Tensor& tensor, Precision precision) {
  if (!(tensor.shape == to.shape) || (tensor.type() != to.type && to.shape.count() > 0))
    throw Error(ErrorKind::Failed, "a tensor does not fit its place", "upload", tensor.shape.text(), to.shape.text());
  const std::size_t numbers = to.type == Type::Int ? tensor.integer.size() : tensor.real.size();
  if (numbers != static_cast<std::size_t>(to.shape.count()))
    throw Error(ErrorKind::Failed, "a tensor does not have the numbers of its shape", "upload",
                fmt::format("{}", numbers), to.shape.text());
  if (to.type == Type::Int)
    upload_as<int>(device, to, tensor.integer);
  else if (precision == Precision::Double)
    upload_as<double>(device, to, tensor.real);
  else
    upload_as<float>(device, to, tensor.real);
}

Tensor download(Device& device, const TensorView& from, Precision precision) {
  Tensor t;
  t.shape = from.shape;
  if (from.type == Type::Int)
    download_as<int>(device, from, t.integer);
  else if (precision == Precision::Double)
    download_as<double>(device, from, t.real);
  else
    download_as<float>(device, from, t.real);
  return t;
}

}  // namespace clerestory
