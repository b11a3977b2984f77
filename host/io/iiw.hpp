// Intrinsic Images in the Wild (Bell, Bala and Snavely 2014): pictures with people's judgements of which of two points
// has the darker surface, <id>.json beside <id>.png.
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace clerestory {

enum class Darker { First, Second, Equal };

struct JudgedPoint {
  std::int64_t id = 0;
  double x = 0, y = 0;  // fractions of the picture's width and height, 0 to 1
  bool opaque = true;   // no glass and no mirror
};

struct JudgedPair {
  std::size_t first = 0, second = 0;  // of the points
  std::optional<Darker> darker;       // nothing: people did not agree
  double weight = 0;
};

struct Judgements {
  std::vector<JudgedPoint> points;
  std::vector<JudgedPair> comparisons;
};

/// Keys intrinsic_points (id, x, y, opaque) and intrinsic_comparisons (point1, point2, darker "1", "2", "E" or null,
/// darker_score); others are passed over. Where darker is null, so may the score be. Throws usage_error naming file and
/// key: no points, an id twice, a place outside of the picture, a comparison of a point that is not there.
Judgements read_judgements(const std::filesystem::path& path);
/// Points are numbered by their `id`, comparisons in their order.
void write_judgements(const std::filesystem::path& path, const Judgements& judgements);

struct IiwPicture {
  std::string id;
  std::filesystem::path picture, judgements;
};
/// Pictures (.png, .jpg) that have judgements beside them, ids sorted as texts. Throws usage_error where there is none,
/// or judgements lack their picture.
std::vector<IiwPicture> list_iiw(const std::filesystem::path& folder);

/// The split that is in use: of all ids, sorted as texts, every fifth from the first on is for tests.
std::vector<IiwPicture> iiw_split(const std::vector<IiwPicture>& all, bool test);

}  // namespace clerestory
