#include "host/ops/light/image_light.hpp"

#include "host/ops/light/gather_rays.hpp"
#include "host/ops/light/project_rays.hpp"
#include "host/ops/light/rays.hpp"
#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "light/image_light.cl";

void check_light(const Value& image, const Value& ambient, const char* op) {
  const Shape& s = image.shape();
  if (!(ambient.shape() == Shape{s.n, 3, 1, 1}))
    throw Error(ErrorKind::Failed, "the ambient radiance has another shape", op, ambient.shape().text(),
                Shape{s.n, 3, 1, 1}.text());
}

void check_hits(const Value& image, const Value& ambient, const Value& hit_pixel) {
  check_light(image, ambient, "image_light");
  if (image.shape().c != 3 || hit_pixel.type() != Type::Int)
    throw Error(ErrorKind::Failed, "a picture of 3 channels and pixel indices are wanted", "image_light",
                image.shape().text());
}

/// What the kernels share: rays in the last input, radiance out.
struct LightOp : Op {
  std::string kernel;
  Shape picture;
  LightOp(std::string k, Shape p) : kernel(std::move(k)), picture(p) {}
  std::string name() const override { return kernel; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    const Value& rays = in.back();
    check_rays(rays, rays.shape().c, kernel.c_str());
    return {{{1, 3, rays.shape().h, rays.shape().w}, Type::Real}};
  }
  template <class... Tensors>
  void run(Launch& l, const Tensors&... tensors) const {
    const RayTile t = ray_tile(l, l.out().shape);
    l.run_with(row_defines(l.device), kFile, kernel, ray_range(t), tensors..., l.out(), t.first_pixel, t.pixels,
               t.first_sample, t.samples, t.pixel_capacity, t.sample_capacity, picture.n, picture.w, picture.h);
  }
};

/// Gradient of the ambient. Inputs: gradient of rays and, where only misses see the ambient, their hits.
struct AmbientAdjointOp : NotDifferentiable {
  Shape picture;
  explicit AmbientAdjointOp(const Shape& p) : picture(p) {}
  std::string name() const override { return "ambient_adjoint"; }
  std::vector<Signature> infer(std::span<const Value>) const override { return {{{picture.n, 3, 1, 1}, Type::Real}}; }
  std::size_t workspace(const Node& node) const override { return 3 * static_cast<std::size_t>(node.in_shape(0).h); }
  void launch(Launch& l) const override {
    const RayTile t = ray_tile(l, l.in(0).shape);
    TensorView rows = l.workspace;
    rows.shape = {1, 3, t.pixel_capacity, 1};
    const Defines defines = row_defines(l.device);
    const auto sum_rows = [&](const char* kernel, const auto&... tensors) {
      l.run_with(defines, kFile, kernel, row_range(l.device, t.pixels, 3), tensors..., rows, t.first_pixel, t.pixels,
                 t.first_sample, t.samples, t.pixel_capacity, t.sample_capacity);
    };
    if (l.inputs.size() > 1)
      sum_rows("miss_sums", l.in(0), l.in(1));
    else
      sum_rows("row_sums", l.in(0));
    l.run_with(defines, kFile, "picture_sums", row_range(l.device, picture.n, 3), rows, l.out(), t.first_pixel,
               t.pixels, t.pixel_capacity, picture.n, static_cast<int>(picture.plane()));
  }
};

struct ImageLightOp : LightOp {
  using LightOp::LightOp;
  Slope slope(int input, int) const override { return input < 2 ? Slope::Adjoint : Slope::None; }
  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    const Value hit = node.inputs[2];
    return {scatter_rays(g[0], hit, picture), node.graph->make<AmbientAdjointOp>({g[0], hit}, picture), {}};
  }
  void launch(Launch& l) const override { run(l, l.in(0), l.in(1), l.in(2)); }
};
/// Of the gradient of rays that are unsure of their hit, the image's part or the ambient's. Inputs: gradient, hits, u.
struct UnsureShareOp : NotDifferentiable {
  bool ambient;
  explicit UnsureShareOp(bool a) : ambient(a) {}
  std::string name() const override { return "unsure_share"; }
  std::vector<Signature> infer(std::span<const Value> in) const override { return {{in[0].shape()}}; }
  void launch(Launch& l) const override {
    const RayTile t = ray_tile(l, l.out().shape);
    l.run_with(row_defines(l.device), kFile, "unsure_share", ray_range(t), l.in(0), l.in(1), l.in(2), l.out(),
               t.first_pixel, t.pixels, t.first_sample, t.samples, t.pixel_capacity, t.sample_capacity,
               static_cast<int>(ambient));
  }
};

struct UnsureLightOp : LightOp {
  using LightOp::LightOp;
  Slope slope(int input, int) const override { return input < 2 ? Slope::Adjoint : Slope::None; }
  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    const Value hit = node.inputs[2], u = node.inputs[3];
    const auto share = [&](bool ambient) { return node.graph->make<UnsureShareOp>({g[0], hit, u}, ambient); };
    return {
        scatter_rays(share(false), hit, picture), node.graph->make<AmbientAdjointOp>({share(true)}, picture), {}, {}};
  }
  void launch(Launch& l) const override { run(l, l.in(0), l.in(1), l.in(2), l.in(3)); }
};
struct ConstantLightOp : LightOp {
  using LightOp::LightOp;
  Slope slope(int input, int) const override {
    return input == 0 ? Slope::Adjoint : Slope::Detached;
  }  // the same for all rays
  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    return {node.graph->make<AmbientAdjointOp>({g[0]}, picture), {}};
  }
  void launch(Launch& l) const override { run(l, l.in(0)); }
};

}  // namespace

Value image_light(Value image, Value ambient, Value hit_pixel) {
  check_hits(image, ambient, hit_pixel);
  return image.graph().make<ImageLightOp>({image, ambient, hit_pixel}, "image_light", image.shape());
}

Value image_light(Value image, Value ambient, Value hit_pixel, Value u) {
  check_hits(image, ambient, hit_pixel);
  if (u.type() != Type::Real || !(u.shape() == hit_pixel.shape()))
    throw Error(ErrorKind::Failed, "the uncertainty is of other rays", "image_light", u.shape().text(),
                hit_pixel.shape().text());
  return image.graph().make<UnsureLightOp>({image, ambient, hit_pixel, u}, "unsure_light", image.shape());
}

Value constant_light(Value ambient, Value rays, Value image) {
  check_light(image, ambient, "constant_light");
  return ambient.graph().make<ConstantLightOp>({ambient, rays}, "constant_light", image.shape());
}

Value panorama_light(Value image, Value ambient, Value camera, Value directions) {
  return image_light(image, ambient, project_rays(directions, camera, image.shape()));
}

Value mirrored_light(Value image, Value ambient, Value camera, Value directions) {
  return image_light(image, ambient, mirrored_rays(directions, camera, image.shape()));
}

}  // namespace clerestory
