#include "host/ops/tensor/resize.hpp"

#include <algorithm>

#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "tensor/resize.cl";
constexpr int kGpuRows = 8;    // rows of one work-group; a CPU's takes whole planes, so that tables are made once
constexpr int kCpuPlanes = 4;  // planes of one work-group

/// Outputs that read one input, at most: those within one input's distance on either side.
int most_readers(int ins, int outs, Aligned aligned) {
  if (ins == 1) return outs;
  return std::min(outs, (aligned == Aligned::Centres ? 2 * outs / ins : 2 * (outs - 1) / (ins - 1)) + 1);
}

Defines defines_of(const Device& device, Aligned aligned) {
  return aligned == Aligned::Centres ? row_defines(device, {{"CENTRES", "1"}}) : row_defines(device);
}

int planes_of(const Device& device) { return row_group(device) == 1 ? kCpuPlanes : 1; }

int rows_of(const Device& device, int height) { return row_group(device) == 1 ? height : std::min(height, kGpuRows); }

int whole_vectors(int n) { return (n + 15) / 16 * 16; }

std::vector<Signature> resized(const Value& x, int h, int w, const char* op) {
  Shape s = x.shape();
  if (h < 1 || w < 1) throw Error(ErrorKind::Failed, "an empty plane", op, fmt::format("{}x{}", h, w));
  s.h = h, s.w = w;
  return {{s, Type::Real}};
}

struct BilinearAdjointOp : NotDifferentiable {  // dy -> dx
  Shape input;
  Aligned aligned;
  BilinearAdjointOp(Shape s, Aligned a) : input(s), aligned(a) {}
  std::string name() const override { return "resize_bilinear_adjoint"; }
  std::vector<Signature> infer(std::span<const Value>) const override { return {{input, Type::Real}}; }
  void launch(Launch& l) const override {
    const Shape& out = l.in(0).shape;
    // Readers of the first column begin where the pattern of the next two goes on, at most one before their own.
    const int most_y = most_readers(input.h, out.h, aligned), most_x = most_readers(input.w, out.w, aligned) + 1,
              rows = rows_of(l.device, input.h);
    const int planes = planes_of(l.device);
    const int pitch = whole_vectors(input.w), line_pitch = whole_vectors(out.w + most_x + 32);
    const std::size_t real = real_size(l.precision);
    l.run_with(defines_of(l.device, aligned), kFile, "resize_bilinear_adjoint",
               row_range(l.device, (input.h + rows - 1) / rows, (input.c + planes - 1) / planes, input.n), l.in(0),
               l.out(), input.c, input.h, input.w, out.h, out.w, most_y, most_x, rows, planes, line_pitch, pitch,
               Arg::local(size(planes * line_pitch) * real), Arg::local(size(most_x * pitch) * real),
               Arg::local(size(pitch) * sizeof(int)));
  }
};

struct BilinearOp : Op {
  int h, w;
  Aligned aligned;
  BilinearOp(int h_, int w_, Aligned a) : h(h_), w(w_), aligned(a) {}
  std::string name() const override { return "resize_bilinear"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    return resized(in[0], h, w, "resize_bilinear");
  }
  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    return {g[0].graph().make<BilinearAdjointOp>({g[0]}, node.in_shape(0), aligned)};
  }
  void launch(Launch& l) const override {
    const Shape& s = l.in(0).shape;
    const int rows = rows_of(l.device, h), planes = planes_of(l.device), pitch = whole_vectors(w);
    const std::size_t real = real_size(l.precision);
    l.run_with(defines_of(l.device, aligned), kFile, "resize_bilinear",
               row_range(l.device, (h + rows - 1) / rows, (s.c + planes - 1) / planes, s.n), l.in(0), l.out(), s.c, s.h,
               s.w, h, w, rows, planes, pitch, Arg::local(size(2 * pitch) * real), Arg::local(size(pitch) * real),
               Arg::local(size(pitch) * sizeof(int)));
  }
};

struct SampleOp : NotDifferentiable {
  bool area;
  int h, w;
  SampleOp(bool a, int h_, int w_) : area(a), h(h_), w(w_) {}
  std::string name() const override { return area ? "resize_area" : "resize_nearest"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    return resized(in[0], h, w, name().c_str());
  }
  void launch(Launch& l) const override {
    const Shape& s = l.in(0).shape;
    const Range range{{size(h) * size(w), size(s.c), size(s.n)}, {64, 1, 1}};
    l.run(kFile, area ? "resize_area" : "resize_nearest", range, l.in(0), l.out(), s.h, s.w, h, w);
  }
};

}  // namespace

Value resize_bilinear(Value x, int height, int width, Aligned aligned) {
  if (x.shape().h == height && x.shape().w == width) return x;
  return x.graph().make<BilinearOp>({x}, height, width, aligned);
}

Value resize_area(Value x, int height, int width) { return x.graph().make<SampleOp>({x}, true, height, width); }
Value resize_nearest(Value x, int height, int width) { return x.graph().make<SampleOp>({x}, false, height, width); }

}  // namespace clerestory
