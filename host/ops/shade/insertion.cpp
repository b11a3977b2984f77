#include "host/ops/shade/insertion.hpp"

#include <array>

#include "host/ops/shade/pictures.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "shade/insertion.cl";

struct InsertionOp : NotDifferentiable {
  std::string name() const override { return "insertion"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    check_pictures(in, std::array{3, 3, 1, 3, 3, 1}, name());
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
