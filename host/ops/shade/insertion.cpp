#include "host/ops/shade/insertion.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "shade/insertion.cl";

void check_picture(const Value& value, const Shape& photo, int channels) {
  const Shape wanted{1, channels, photo.h, photo.w};
  if (!(value.shape() == wanted))
    throw Error(ErrorKind::Failed, "a picture of another shape", "insertion", value.shape().text(), wanted.text());
}

struct InsertionOp : NotDifferentiable {
  std::string name() const override { return "insertion"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    const int channels[] = {3, 3, 1, 3, 3, 1};
    for (std::size_t k = 0; k < in.size(); ++k) check_picture(in[k], in[0].shape(), channels[k]);
    return {{in[0].shape()}};
  }
  void launch(Launch& l) const override {
    const int plane = static_cast<int>(l.out().shape.plane());
    l.run(kFile, "insertion", Range::of2(static_cast<std::size_t>(plane), 3), l.in(0), l.in(1), l.in(2), l.in(3),
          l.in(4), l.in(5), l.out(), plane);
  }
};

}  // namespace

Value insertion(const InsertionPictures& p) {
  return p.photo.graph().make<InsertionOp>({p.photo, p.objects, p.covers, p.change, p.without, p.emits});
}

}  // namespace clerestory
