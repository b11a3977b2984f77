#include "experiments/weights/map_predictor.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "experiments/evaluation/prepare.hpp"
#include "host/error.hpp"

namespace clerestory {
namespace {

void to_mean(Image& one, const Image& other) {
  for (std::size_t i = 0; i < one.data.size(); ++i) one.data[i] = 0.5f * (one.data[i] + other.data[i]);
}

/// Where two normals cancel, that of `one` stays.
void to_mean_direction(Image& one, const Image& other) {
  for (std::size_t i = 0; i < one.pixels(); ++i) {
    float sum[3], squares = 0;
    for (int c = 0; c < 3; ++c) sum[c] = one.plane(c)[i] + other.plane(c)[i], squares += sum[c] * sum[c];
    if (squares == 0) continue;
    for (int c = 0; c < 3; ++c) one.plane(c)[i] = sum[c] / std::sqrt(squares);
  }
}

/// Picture `index` of a fetched map, without its padding.
Image picture_at(const std::vector<float>& data, const Shape& shape, std::size_t index, int width, int height) {
  Image padded(shape.w, shape.h, shape.c);
  const auto first = data.begin() + static_cast<std::ptrdiff_t>(index * static_cast<std::size_t>(shape.item()));
  padded.data.assign(first, first + shape.item());
  return cut(padded, width, height);
}

}  // namespace

std::vector<Value> wanted_outputs(const Maps& maps, const WantedMaps& wanted) {
  std::vector<Value> outputs;
  if (wanted.albedo) outputs.push_back(maps.albedo);
  if (wanted.normal) outputs.push_back(maps.normal);
  if (wanted.depth) outputs.insert(outputs.end(), {maps.depth, maps.log_scale});
  if (wanted.material) outputs.push_back(maps.material);
  return outputs;
}

MapPrediction mean_of(MapPrediction one, const MapPrediction& other) {
  to_mean(one.maps.albedo, other.maps.albedo), to_mean(one.maps.depth, other.maps.depth);
  to_mean(one.maps.material, other.maps.material);
  to_mean_direction(one.maps.normal, other.maps.normal);
  one.log_scale = 0.5 * (one.log_scale + other.log_scale);
  return one;
}

MapPrediction mirrored(MapPrediction prediction) {
  MapSet& m = prediction.maps;
  for (Image* map : {&m.albedo, &m.depth, &m.material}) *map = mirrored(*map);
  m.normal = mirrored_normals(m.normal);
  return prediction;
}

struct MapPredictor::State {
  struct Net {
    Graph graph;
    Maps maps;
    std::unique_ptr<Executor> run;
  };
  Device device;
  MgnetSize size;
  std::shared_ptr<States> states;
  int batch;
  WantedMaps wanted;
  Precision precision;
  std::map<std::pair<int, int>, std::unique_ptr<Net>> nets;  // by padded height and width

  /// The net for pictures of this size.
  Net& net(int width, int height) {
    const int padded_width = padded_size(width), padded_height = padded_size(height);
    std::unique_ptr<Net>& found = nets[{padded_height, padded_width}];
    if (found) return *found;
    auto made = std::make_unique<Net>();
    made->maps = mgnet(made->graph, made->graph.input("image", {batch, 3, padded_height, padded_width}), size, false);
    made->run = std::make_unique<Executor>(
        compile(made->graph, wanted_outputs(made->maps, wanted), device, {.precision = precision}), states);
    found = std::move(made);
    return *found;
  }

  void feed(Net& net, const std::vector<Image>& pictures, std::size_t first) const {
    std::vector<float> image;
    for (std::size_t k = 0; k < static_cast<std::size_t>(batch); ++k) {  // a group that is not full repeats its last
      const Image input = net_input(pictures[std::min(first + k, pictures.size() - 1)]);
      image.insert(image.end(), input.data.begin(), input.data.end());
    }
    net.run->feed("image", image);
  }

  /// What the net says of pictures of one size, each as it is.
  std::vector<MapPrediction> predict(const std::vector<Image>& pictures) {
    const int width = pictures[0].width, height = pictures[0].height;
    Net& on = net(width, height);
    std::vector<MapPrediction> out;
    for (std::size_t first = 0; first < pictures.size(); first += static_cast<std::size_t>(batch)) {
      feed(on, pictures, first);
      on.run->run();
      const std::size_t count = std::min(pictures.size() - first, static_cast<std::size_t>(batch));
      out.resize(first + count);
      const auto fetch = [&](bool is_wanted, Value map, Image MapSet::*to) {
        if (!is_wanted) return;
        const std::vector<float> data = on.run->fetch_floats(map);
        for (std::size_t k = 0; k < count; ++k)
          out[first + k].maps.*to = picture_at(data, map.shape(), k, width, height);
      };
      fetch(wanted.albedo, on.maps.albedo, &MapSet::albedo), fetch(wanted.normal, on.maps.normal, &MapSet::normal);
      fetch(wanted.depth, on.maps.depth, &MapSet::depth), fetch(wanted.material, on.maps.material, &MapSet::material);
      if (!wanted.depth) continue;
      const std::vector<double> log_scale = on.run->fetch(on.maps.log_scale).real;
      for (std::size_t k = 0; k < count; ++k) out[first + k].log_scale = log_scale[k];
    }
    return out;
  }
};

MapPredictor::MapPredictor(Device device, const MgnetSize& net, std::shared_ptr<States> states, int batch,
                           const WantedMaps& wanted, Precision precision)
    : state_(new State{std::move(device), net, std::move(states), batch, wanted, precision, {}}) {}

MapPredictor::~MapPredictor() = default;

std::vector<MapPrediction> MapPredictor::predict(const std::vector<const Image*>& pictures) {
  for (const Image* p : pictures)
    if (p->width != pictures[0]->width || p->height != pictures[0]->height || p->channels != 3)
      throw Error(ErrorKind::Failed, "pictures of unlike sizes in one prediction", "predict",
                  fmt::format("{}x{}", p->width, p->height),
                  fmt::format("{}x{}", pictures[0]->width, pictures[0]->height));
  std::vector<MapPrediction> out;
  const auto batch = static_cast<std::size_t>(state_->batch);
  for (std::size_t first = 0; first < pictures.size(); first += batch) {  // both ways these fill two batches
    std::vector<Image> both_ways;
    for (std::size_t k = first; k < std::min(first + batch, pictures.size()); ++k)
      both_ways.push_back(*pictures[k]), both_ways.push_back(mirrored(*pictures[k]));
    std::vector<MapPrediction> said = state_->predict(both_ways);
    for (std::size_t i = 0; i < said.size(); i += 2)
      out.push_back(mean_of(std::move(said[i]), mirrored(std::move(said[i + 1]))));
  }
  return out;
}

std::string MapPredictor::explain(int width, int height) { return state_->net(width, height).run->explain(); }

}  // namespace clerestory
