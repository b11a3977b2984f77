#include "tests/experiments/synthetic_views.hpp"

#include <unistd.h>

#include <random>

#include "host/io/datasets.hpp"

namespace clerestory {

ScratchFolder::ScratchFolder(const std::string& name)
    : path_(std::filesystem::temp_directory_path() / (name + "-" + std::to_string(getpid()))) {
  std::filesystem::remove_all(path_);
  std::filesystem::create_directories(path_);
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

void write_synthetic_rooms(const std::filesystem::path& root, const std::string& split, int rooms, int views, int width,
                           int height, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(0, 1);
  std::vector<std::string> names;
  for (int r = 0; r < rooms; ++r) {
    const std::string name = split + "_room_" + std::to_string(r);
    names.push_back(name);
    std::filesystem::create_directories(root / name);
    for (int v = 0; v < views; ++v) {
      RoomView view;
      view.image = Image(width, height, 3), view.albedo = Image(width, height, 3),
      view.normal = Image(width, height, 3);
      view.mask = Image(width, height, 1, 1.0f), view.depth = Image(width, height, 1);
      view.material = Image(width, height, 3), view.emission = Image(width, height, 3);
      const float far = 2 + 3 * uniform(random), horizon = 0.3f + 0.4f * uniform(random);
      const float wall[3] = {0.2f + 0.6f * uniform(random), 0.2f + 0.6f * uniform(random),
                             0.2f + 0.6f * uniform(random)};
      const float roughness = 0.2f + 0.7f * uniform(random);
      for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
          const bool floor = y > horizon * static_cast<float>(height);
          const float shade = 0.3f + 0.7f * static_cast<float>(x) / static_cast<float>(width);
          view.depth.at(0, y, x) = floor ? far * horizon * static_cast<float>(height) / static_cast<float>(y + 1) : far;
          view.normal.at(floor ? 1 : 2, y, x) = 1;
          view.material.at(0, y, x) = floor ? 0.3f : roughness;
          view.material.at(1, y, x) = floor ? 0.0f : 1.0f;
          for (int c = 0; c < 3; ++c) {
            view.albedo.at(c, y, x) = floor ? 0.4f : wall[c];
            view.image.at(c, y, x) = view.albedo.at(c, y, x) * shade;
          }
          if (x >= width - 2 && y < 2)
            for (int c = 0; c < 3; ++c) view.emission->at(c, y, x) = view.image.at(c, y, x) = 4;
        }
      write_view(root / name, view_id(v), view);
    }
  }
  write_rooms(root, split, names);
}

}  // namespace clerestory
