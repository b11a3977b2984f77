// What stands in a kind of room.
#pragma once
#include <string>

#include "tracer/layout.hpp"

namespace clerestory {

/// Places what a kind of room has, then what any room may have, then what lies about.
class Furnisher {
 public:
  Furnisher(Layout& layout, const Kit& kit, Shapes& shapes, const glm::vec3& size, Random& random)
      : layout_(layout), kit_(kit), shapes_(shapes), size_(size), random_(random) {}
  void furnish(const std::string& kind, bool with_bed) const;
  void fill() const;
  void litter() const;
  /// What training rooms have beside.
  void further() const;

 private:
  void living() const;
  void dining() const;
  void bedroom(bool with_bed) const;
  void office() const;
  void kitchen() const;
  void bathroom() const;
  void studio() const;
  void rug(const glm::mat4& pose, float width, float depth) const;

  Layout& layout_;
  const Kit& kit_;
  Shapes& shapes_;
  const glm::vec3& size_;
  Random& random_;
};

}  // namespace clerestory
