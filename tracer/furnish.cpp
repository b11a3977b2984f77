#include "tracer/furnish.hpp"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

namespace clerestory {

void Furnisher::furnish(const std::string& kind, bool with_bed) const {
  if (kind == "living") living();
  if (kind == "dining") dining();
  if (kind == "bedroom") bedroom(with_bed);
  if (kind == "office") office();
  if (kind == "kitchen") kitchen();
  if (kind == "bathroom") bathroom();
  if (kind == "studio") studio();
}

void Furnisher::rug(const glm::mat4& pose, float width, float depth) const {
  Shapes s = shapes_.at(pose);
  const glm::vec4 middle = pose * glm::vec4(0, 0, 0, 1);
  const float most_x = 2 * (size_.x / 2 - std::abs(middle.x)) - 0.1f,
              most_z = 2 * (size_.z / 2 - std::abs(middle.z)) - 0.1f;
  const float most = std::min(most_x, most_z);
  if (most < 0.6f) return;
  const float w = std::min(width, most) / 2, d = std::min(depth, most) / 2;
  const int m = s.material(kit_.palette->rug());
  s.canvas({-w, 0.008f, d}, {w, 0.008f, d}, {w, 0.008f, -d}, {-w, 0.008f, -d}, m);
}

void Furnisher::living() const {
  if (random_.chance(0.2f)) layout_.against_wall(fireplace(kit_, random_, size_.y), true, 0);
  const float width = random_.between(1.5f, 2.4f);
  if (layout_.against_wall(sofa(kit_, random_, width), true,
                           random_.chance(0.4f) ? random_.between(0.1f, 0.5f) : 0.03f)) {
    const glm::mat4 at = layout_.last();
    if (random_.chance(0.7f))
      rug(glm::translate(at, {0, 0, 1.1f}), random_.between(1.8f, 2.6f), random_.between(1.3f, 1.8f));
    if (random_.chance(0.8f))
      layout_.before_last(coffee_table(kit_, random_), random_.between(1.05f, 1.25f), false);
    else
      layout_.before_last(pouffe(kit_, random_), 1.1f, false);
    if (random_.chance(0.6f)) layout_.beside_last(floor_lamp(kit_, random_), width / 2 + 0.3f, -0.15f);
    if (random_.chance(0.5f)) layout_.beside_last(side_table(kit_, random_), width / 2 + 0.32f, 0);
    if (random_.chance(0.5f))
      layout_.before_last(sofa(kit_, random_, random_.between(0.8f, 0.95f)), random_.between(2.1f, 2.6f), true);
  }
  layout_.against_wall(tv_stand(kit_, random_), true);
  layout_.against_wall(random_.chance(0.6f) ? bookshelf(kit_, random_) : cabinet(kit_, random_));
}

void Furnisher::dining() const {
  layout_.in_the_open(dining_table(kit_, random_), 0.25f);
  if (random_.chance(0.35f)) rug(layout_.last(), 2.4f, 1.8f);
  layout_.against_wall(cabinet(kit_, random_), true);
  if (random_.chance(0.5f)) layout_.against_wall(bookshelf(kit_, random_));
  if (random_.chance(0.3f)) layout_.against_wall(bench(kit_, random_));
}

void Furnisher::bedroom(bool with_bed) const {
  if (with_bed && layout_.against_wall(bed(kit_, random_), true)) {
    const glm::mat4 at = layout_.last();
    if (random_.chance(0.5f)) rug(glm::translate(at, {0, 0, 0.9f}), 2.2f, 1.5f);
    layout_.beside_last(side_table(kit_, random_), 1.3f, -0.75f);
    layout_.beside_last(side_table(kit_, random_), 1.3f, -0.75f);
  }
  layout_.against_wall(wardrobe(kit_, random_, size_.y));
  if (!with_bed) layout_.against_wall(wardrobe(kit_, random_, size_.y));
  if (random_.chance(0.4f)) layout_.against_wall(leaning_picture(kit_, random_), false, 0.02f);
  if (random_.chance(0.4f)) layout_.against_wall(bench(kit_, random_));
  layout_.against_wall(random_.chance(0.5f) ? cabinet(kit_, random_) : desk(kit_, random_));
}

void Furnisher::office() const {
  for (int i = random_.whole(1, 2); i > 0; --i) layout_.against_wall(desk(kit_, random_), false);
  layout_.against_wall(bookshelf(kit_, random_));
  layout_.against_wall(random_.chance(0.4f)   ? cabinet(kit_, random_)
                       : random_.chance(0.5f) ? metal_rack(kit_, random_)
                                              : bookshelf(kit_, random_));
  if (random_.chance(0.3f)) layout_.against_wall(wardrobe(kit_, random_, size_.y));
}

void Furnisher::kitchen() const {
  const float longest = std::max(size_.x, size_.z);
  for (const float share : {0.85f, 0.65f, 0.5f}) {
    if (layout_.against_wall(kitchen_row(kit_, random_, std::min(longest * share, 3.6f)), true, 0.005f)) break;
  }
  layout_.against_wall(fridge(kit_, random_));
  layout_.in_the_open(dining_table(kit_, random_), 0.2f);
  if (random_.chance(0.4f)) layout_.against_wall(metal_rack(kit_, random_));
}

void Furnisher::bathroom() const {
  layout_.against_wall(bathtub(kit_, random_), false, 0.005f);
  layout_.against_wall(washstand(kit_, random_), false, 0.005f);
  layout_.against_wall(toilet(kit_, random_), false, 0.005f);
  if (random_.chance(0.5f)) layout_.against_wall(washing_machine(kit_, random_));
  if (random_.chance(0.6f)) layout_.in_the_open(basket(kit_, random_), 0.8f);
  if (random_.chance(0.6f)) rug(glm::mat4(1), random_.between(0.6f, 1.1f), random_.between(0.5f, 0.8f));
}

void Furnisher::studio() const {
  for (int i = random_.whole(1, 3); i > 0; --i) layout_.against_wall(box_stack(kit_, random_));
  layout_.in_the_open(coffee_table(kit_, random_), 0.4f);
  for (int i = random_.whole(1, 3); i > 0; --i) layout_.in_the_open(ball(kit_, random_), 0.7f, true);
  layout_.against_wall(metal_rack(kit_, random_));
  layout_.against_wall(cabinet(kit_, random_));
}

void Furnisher::fill() const {
  for (int i = random_.whole(3, 6); i > 0; --i) {
    switch (random_.whole(0, 11)) {
      case 0:
        layout_.against_wall(bookshelf(kit_, random_));
        break;
      case 1:
        layout_.against_wall(cabinet(kit_, random_));
        break;
      case 2:
      case 3:
        layout_.against_wall(plant(kit_, random_), false, 0.08f);
        break;
      case 4:
        layout_.against_wall(chair(kit_, random_));
        break;
      case 5:
        layout_.in_the_open(stool(kit_, random_), 0.8f, true);
        break;
      case 6:
        layout_.in_the_open(pouffe(kit_, random_), 0.8f, true);
        break;
      case 7:
        layout_.against_wall(side_table(kit_, random_));
        break;
      case 8:
        layout_.against_wall(floor_lamp(kit_, random_), false, 0.1f);
        break;
      case 9:
        layout_.against_wall(leaning_picture(kit_, random_), false, 0.02f);
        break;
      case 10:
        layout_.against_wall(bench(kit_, random_));
        break;
      default:
        layout_.against_wall(sofa(kit_, random_, random_.between(0.8f, 0.95f)), false, 0.1f);
        break;
    }
  }
  if (kit_.models && !kit_.models->empty() && random_.chance(0.2f)) {
    layout_.against_wall(pedestal(kit_, random_, random_.one_of(*kit_.models)), false, 0.12f);
  }
}

void Furnisher::further() const {
  if (random_.chance(0.2f)) layout_.in_the_open(column(kit_, random_, size_.y), 0.9f);
  if (random_.chance(0.2f)) layout_.against_wall(clothes_rack(kit_, random_), false, random_.between(0.02f, 0.2f));
  if (random_.chance(0.15f)) layout_.in_the_open(screen(kit_, random_), 0.8f, true);
  if (random_.chance(0.25f)) layout_.against_wall(metal_rack(kit_, random_));
}

void Furnisher::litter() const {
  // Some rooms are tidy, some are not.
  const bool tidy = random_.chance(0.3f);
  const int count =
      tidy ? random_.whole(0, 1) : random_.whole(2, 9) + (kit_.palette->is_varied() ? random_.whole(0, 6) : 0);
  for (int i = 0; i < count; ++i) {
    const Piece piece = floor_clutter(kit_, random_);
    if (random_.chance(0.6f))
      layout_.against_wall(piece, false, random_.between(0.02f, 0.1f));
    else
      layout_.in_the_open(piece, 0.9f, true);
  }
}

}  // namespace clerestory
