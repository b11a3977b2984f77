#include "experiments/weights/map_predictor.hpp"

#include <cmath>
#include <random>

#include "experiments/evaluation/prepare.hpp"
#include "gtest/gtest.h"
#include "nets/scene_maps.hpp"

namespace clerestory {
namespace {

constexpr int kWidth = 40, kHeight = 27;  // neither is a multiple of 32

Image noise(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> radiance(0, 1.2f);
  Image image(kWidth, kHeight, 3);
  for (float& v : image.data) v = radiance(random);
  return image;
}

class MapPredictorTest : public testing::Test {
 protected:
  MapPredictorTest() {
    Graph graph;
    mgnet(graph, graph.input("image", {1, 3, 64, 64}), net_, false);
    states_ = std::make_shared<States>(device_);
    states_->initialise(graph, 3);
  }

  MapPredictor predictor(int batch, const WantedMaps& wanted = {}) {
    return MapPredictor(device_, net_, states_, batch, wanted);
  }

  /// What the net says of a picture, without its padding.
  MapPrediction said_of(const Image& picture) {
    Graph graph;
    const Image input = net_input(picture);
    const Maps maps = mgnet(graph, graph.input("image", {1, 3, input.height, input.width}), net_, false);
    Executor run(compile(graph, {maps.albedo, maps.normal, maps.depth, maps.material, maps.log_scale}, device_),
                 states_);
    run.feed("image", tensor_of(input));
    run.run();
    const auto map = [&](Value value) { return cut(fetch_image(run, value), picture.width, picture.height); };
    return {{map(maps.albedo), map(maps.normal), map(maps.depth), map(maps.material)},
            run.fetch(maps.log_scale).real[0]};
  }

  Device device_ = Device::open();
  MgnetSize net_ = mgnet_size("lite");
  std::shared_ptr<States> states_;
};

TEST_F(MapPredictorTest, AMirroredPictureHasMirroredMaps) {
  const Image picture = noise(1), turned = mirrored(picture);
  MapPredictor net = predictor(2);
  const MapPrediction maps = net.predict({&picture})[0], of_turned = mirrored(net.predict({&turned})[0]);
  EXPECT_EQ(maps.maps.albedo.data, of_turned.maps.albedo.data);
  EXPECT_EQ(maps.maps.normal.data, of_turned.maps.normal.data);
  EXPECT_EQ(maps.maps.depth.data, of_turned.maps.depth.data);
  EXPECT_EQ(maps.maps.material.data, of_turned.maps.material.data);
  EXPECT_EQ(maps.log_scale, of_turned.log_scale);
}

TEST_F(MapPredictorTest, MapsAreTheMeanOfBothWays) {
  const Image a = noise(1), b = noise(2);
  for (const int batch : {1, 3}) {  // of four pictures: none is repeated, and one group is not full
    MapPredictor net = predictor(batch);
    const std::vector<MapPrediction> both = net.predict({&a, &b});
    for (const Image* picture : {&a, &b}) {
      const MapSet& maps = both[picture == &a ? 0 : 1].maps;
      const MapSet one = said_of(*picture).maps, other = said_of(mirrored(*picture)).maps;
      const auto expect_mean = [&](const Image& mean, const Image& first, const Image& second) {
        for (int c = 0; c < mean.channels; ++c)
          for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < kWidth; ++x)
              ASSERT_NEAR(mean.at(c, y, x), 0.5 * (first.at(c, y, x) + second.at(c, y, kWidth - 1 - x)), 1e-5);
      };
      expect_mean(maps.albedo, one.albedo, other.albedo), expect_mean(maps.depth, one.depth, other.depth);
      expect_mean(maps.material, one.material, other.material);
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
          const int turned = kWidth - 1 - x;
          const double sum[] = {double(one.normal.at(0, y, x)) - other.normal.at(0, y, turned),
                                double(one.normal.at(1, y, x)) + other.normal.at(1, y, turned),
                                double(one.normal.at(2, y, x)) + other.normal.at(2, y, turned)};
          const double length = std::hypot(sum[0], sum[1], sum[2]);
          for (int c = 0; c < 3; ++c) ASSERT_NEAR(maps.normal.at(c, y, x), sum[c] / length, 1e-5 / length);
        }
    }
  }
}

TEST_F(MapPredictorTest, OnlyWhatIsWanted) {
  const Image picture = noise(1);
  MapPredictor all = predictor(2), some = predictor(2, {.albedo = false, .normal = false, .material = false});
  const MapPrediction depth = some.predict({&picture})[0], whole = all.predict({&picture})[0];
  EXPECT_EQ(depth.maps.depth.data, whole.maps.depth.data);
  EXPECT_EQ(depth.log_scale, whole.log_scale);
  for (const Image* left_out : {&depth.maps.albedo, &depth.maps.normal, &depth.maps.material})
    EXPECT_TRUE(left_out->data.empty());
}

TEST(MapPrediction, NormalsThatCancelStay) {
  MapPrediction one, other;
  one.maps.normal = Image(2, 1, 3), other.maps.normal = Image(2, 1, 3);
  one.maps.normal.data = {1, 0, 0, 0, 0, 1}, other.maps.normal.data = {-1, 0, 0, 1, 0, 0};
  const Image mean = mean_of(one, other).maps.normal;
  EXPECT_EQ((std::vector<float>{mean.at(0, 0, 0), mean.at(1, 0, 0), mean.at(2, 0, 0)}), (std::vector<float>{1, 0, 0}));
  EXPECT_FLOAT_EQ(mean.at(1, 0, 1), std::sqrt(0.5f));
  EXPECT_FLOAT_EQ(mean.at(2, 0, 1), std::sqrt(0.5f));
}

}  // namespace
}  // namespace clerestory
