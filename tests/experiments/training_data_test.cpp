// From files to batches: sizes, exposure, units, masks, augmentation, order.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <set>

#include "experiments/evaluation/mean_maps.hpp"
#include "experiments/training/batches.hpp"
#include "host/error.hpp"
#include "host/math/statistics.hpp"
#include "tests/experiments/synthetic_views.hpp"
#include "tests/roundings.hpp"

namespace clerestory {
namespace {

Image ramp(int width, int height, int channels) {
  Image image(width, height, channels);
  for (std::size_t i = 0; i < image.data.size(); ++i) image.data[i] = static_cast<float>(i % 97);
  return image;
}

TEST(Resize, AreaKeepsTheMeanAndWholeFactorsAverageBlocks) {
  const Image image = ramp(6, 4, 2), half = resize_area(image, 3, 2);
  EXPECT_FLOAT_EQ(half.at(1, 1, 2),
                  (image.at(1, 2, 4) + image.at(1, 2, 5) + image.at(1, 3, 4) + image.at(1, 3, 5)) / 4);
  const Image odd = resize_area(ramp(7, 5, 1), 3, 2);  // boxes that share pixels
  EXPECT_NEAR(mean(odd.data), mean(ramp(7, 5, 1).data), 97 * 16 * 6e-8);
}

TEST(Resize, GrowingIsLinearBetweenCentres) {
  Image image(2, 1, 1);
  image.data = {0, 4};
  EXPECT_EQ(resize_area(image, 4, 1).data, (std::vector<float>{0, 1, 3, 4}));
  EXPECT_EQ(resize_area(Image(1, 1, 1, 5.0f), 3, 2).data, std::vector<float>(6, 5.0f));
}

TEST(Resize, NearestTakesThePixelUnderTheCentre) {
  Image image(4, 1, 1);
  image.data = {0, 1, 2, 3};
  EXPECT_EQ(resize_nearest(image, 2, 1).data, (std::vector<float>{1, 3}));
  EXPECT_EQ(resize_nearest(image, 8, 1).data, (std::vector<float>{0, 0, 1, 1, 2, 2, 3, 3}));
}

TEST(Resize, CropPadAndCut) {
  EXPECT_EQ(crop_to_aspect(ramp(10, 4, 1), 4, 3).width, 5);
  EXPECT_EQ(crop_to_aspect(ramp(4, 10, 1), 4, 3).height, 3);
  const Image image = ramp(5, 3, 2), padded = pad_to_multiple(image, 4, true);
  EXPECT_EQ(padded.width, 8);
  EXPECT_EQ(padded.height, 4);
  EXPECT_EQ(padded.at(1, 3, 7), image.at(1, 2, 4));
  EXPECT_EQ(pad_to_multiple(image, 4, false).at(1, 3, 7), 0);
  EXPECT_EQ(cut(padded, 5, 3).data, image.data);
  EXPECT_THROW(cut(image, 6, 3), Error);
  EXPECT_EQ(net_size(640, 480, 160), (Size{160, 120}));
  EXPECT_EQ(net_size(500, 741, 160), (Size{108, 160}));
}

struct TrainingData : testing::Test {
  ScratchFolder folder{"clerestory-training-data"};
  void SetUp() override { write_synthetic_rooms(folder.path(), "train", 2, 3, 48, 36, 5); }
};

TEST_F(TrainingData, PreparedViewHasTheConventions) {
  const auto names = name_views({folder.path().string()}, "train");
  ASSERT_EQ(names.size(), 6u);
  const RoomView raw = read_view(names[0].room, names[0].id);
  const PreparedView view = prepare_view(raw, 48, 36);
  EXPECT_NEAR(luminance_quantile(view.image.data, 0.95), 0.9, 0.9 * 4 * 6e-8);
  EXPECT_NEAR(view.scene_scale, scene_scale(raw.depth.data), 2 * kFloatRounding * view.scene_scale);
  EXPECT_NEAR(view.truth.depth.at(0, 30, 7) * view.scene_scale, raw.depth.at(0, 30, 7),
              4 * kFloatRounding * view.scene_scale);
  // the emitting corner has geometry but no albedo
  EXPECT_EQ(view.masks.geometry.at(0, 0, 47), 1);
  EXPECT_EQ(view.masks.albedo.at(0, 0, 47), 0);
  EXPECT_EQ(view.masks.albedo.at(0, 0, 40), 1);
  // smaller: the same picture, averaged in double and rounded once more, as its exposure is
  const PreparedView small = prepare_view(raw, 16, 12);
  EXPECT_EQ(small.truth.normal.channels, 3);
  EXPECT_NEAR(mean(small.image.data), mean(view.image.data), 8 * kFloatRounding);
}

TEST_F(TrainingData, MasksFollowWhatIsMissing) {
  const auto names = name_views({folder.path().string()}, "train");
  RoomView raw = read_view(names[0].room, names[0].id);
  raw.mask.at(0, 5, 5) = 0;
  for (int c = 0; c < 2; ++c) raw.material.at(c, 6, 6) = 0;
  PreparedView view = prepare_view(raw, 48, 36);
  EXPECT_EQ(view.masks.geometry.at(0, 5, 5), 0);
  EXPECT_EQ(view.masks.material.at(0, 6, 6), 0);
  EXPECT_EQ(view.masks.geometry.at(0, 6, 6), 1);
  std::fill(raw.mask.data.begin(), raw.mask.data.end(), 0.0f);
  raw.mask.data[0] = 1;  // one pixel of 1728 is no scene
  view = prepare_view(raw, 48, 36);
  EXPECT_EQ(view.scene_scale, 0);
  EXPECT_EQ(sum(view.masks.geometry.data), 0);
}

TEST_F(TrainingData, StoreGivesTheSameBitsCachedOrNot) {
  const auto names = name_views({folder.path().string()}, "train");
  ViewStore cached(names, 32, 24, 1 << 20), fresh(names, 32, 24, 0);
  for (int repeat = 0; repeat < 2; ++repeat) {
    const PreparedView a = cached.get(4), b = fresh.get(4);
    EXPECT_EQ(a.image.data, b.image.data);
    EXPECT_EQ(a.truth.depth.data, b.truth.depth.data);
    EXPECT_EQ(a.masks.albedo.data, b.masks.albedo.data);
    EXPECT_EQ(a.scene_scale, b.scene_scale);
  }
  // half keeps eleven bits
  const PreparedView exact = prepare_view(read_view(names[4].room, names[4].id), 32, 24), kept = fresh.get(4);
  for (std::size_t i = 0; i < exact.image.data.size(); ++i)
    EXPECT_NEAR(kept.image.data[i], exact.image.data[i], exact.image.data[i] / 2048 + 0x1p-25);
  // What is kept needs its file no more.
  const std::filesystem::path gone = names[4].room.string() + "-gone";
  std::filesystem::rename(names[4].room, gone);
  EXPECT_EQ(cached.get(4).image.data, kept.image.data);
  EXPECT_THROW(fresh.get(4), Error);
  std::filesystem::rename(gone, names[4].room);
}

TEST_F(TrainingData, OrderVisitsEveryViewOncePerEpoch) {
  ViewOrder order(6, 11), again(6, 11), other(6, 12);
  std::vector<std::size_t> first, second, different;
  for (std::uint64_t p = 0; p < 6; ++p) first.push_back(order.at(p)), different.push_back(other.at(p));
  for (std::uint64_t p = 6; p < 12; ++p) second.push_back(order.at(p));
  EXPECT_EQ(std::set<std::size_t>(first.begin(), first.end()).size(), 6u);
  EXPECT_EQ(std::set<std::size_t>(second.begin(), second.end()).size(), 6u);
  EXPECT_NE(first, second);
  EXPECT_NE(first, different);
  EXPECT_EQ(again.at(8), second[2]);  // from anywhere: no history
}

TEST_F(TrainingData, BatchesAreAFunctionOfSeedAndStep) {
  const auto names = name_views({folder.path().string()}, "train");
  ViewStore store(names, 48, 36, 1 << 20), other(names, 48, 36, 0);
  const auto views = fixed_views(store, 3), others = fixed_views(other, 3);
  const Augmentation augmentation;
  const auto stream = std::make_unique<BatchStream>(*views, augmentation, 3, 0, 4, 0);
  std::vector<TrainingBatch> batches;
  for (int i = 0; i < 5; ++i) batches.push_back(stream->next());
  EXPECT_EQ(batches[0].w, 64);
  EXPECT_EQ(batches[0].h, 64);
  EXPECT_EQ(batches[0].image.size(), 4u * 3 * 64 * 64);
  const auto resumed = std::make_unique<BatchStream>(*others, augmentation, 3, 0, 4, 3);
  for (int step = 3; step < 5; ++step) {
    const TrainingBatch batch = resumed->next();
    EXPECT_EQ(batch.step, step);
    EXPECT_EQ(batch.image, batches[step].image);
    EXPECT_EQ(batch.normal, batches[step].normal);
    EXPECT_EQ(batch.views, batches[step].views);
  }
}

TEST_F(TrainingData, FlipMirrorsMapsAndNegatesNx) {
  const auto names = name_views({folder.path().string()}, "train");
  PreparedView view = prepare_view(read_view(names[1].room, names[1].id), 48, 36);
  view.truth.normal.at(0, 3, 10) = 0.5f;
  const TrainingBatch plain = assemble_batch(view, false, 1), flipped = assemble_batch(view, true, 1);
  const auto at = [](const std::vector<float>& data, int c, int y, int x) { return data[(c * 64 + y) * 64 + x]; };
  EXPECT_EQ(at(flipped.normal, 0, 3, 37), -0.5f);
  EXPECT_EQ(at(plain.normal, 0, 3, 10), 0.5f);
  for (int x = 0; x < 48; ++x) {
    EXPECT_EQ(at(flipped.image, 1, 20, x), at(plain.image, 1, 20, 47 - x));
    EXPECT_EQ(at(flipped.albedo_mask, 0, 0, x), at(plain.albedo_mask, 0, 0, 47 - x));
  }
  EXPECT_EQ(at(flipped.image, 0, 0, 63), at(flipped.image, 0, 0, 47));  // padding repeats
  EXPECT_EQ(at(flipped.geometry_mask, 0, 0, 50), 0);                    // and is masked
  EXPECT_EQ(at(flipped.geometry_mask, 0, 40, 0), 0);
}

TEST_F(TrainingData, BatchIsClampedAndScaled) {
  const auto names = name_views({folder.path().string()}, "train");
  const PreparedView view = prepare_view(read_view(names[1].room, names[1].id), 48, 36);
  const TrainingBatch batch = assemble_batch(view, false, 0.85 / 0.9);
  for (const float v : batch.image) ASSERT_TRUE(v >= 0 && v <= 1);
  EXPECT_FLOAT_EQ(batch.image[10 * 64 + 3], std::min(1.0f, view.image.at(0, 10, 3) * static_cast<float>(0.85 / 0.9)));
  for (const float d : batch.depth) ASSERT_TRUE(d >= 0 && d <= 1);
  EXPECT_FLOAT_EQ(batch.log_scale[0], static_cast<float>(std::log(view.scene_scale)));
}

TEST_F(TrainingData, BrokenFileStopsTheStreamWithItsName) {
  const auto names = name_views({folder.path().string()}, "train");
  const auto victim = view_file(names[2].room, names[2].id, "depth");
  std::ofstream(victim, std::ios::trunc) << "not a picture";
  ViewStore store(names, 48, 36, 1 << 20);
  const auto views = fixed_views(store, 3);
  const auto stream = std::make_unique<BatchStream>(*views, Augmentation{}, 3, 0, 6, 0);
  try {
    stream->next();
    FAIL() << "the broken file went unnoticed";
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::Usage);
    EXPECT_NE(std::string(e.what()).find(victim.filename().string()), std::string::npos) << e.what();
  }
}

TEST_F(TrainingData, MissingListOrEmptyOneIsAnError) {
  EXPECT_THROW(name_views({folder.path().string()}, "val"), Error);
  EXPECT_THROW(name_views({}, "train"), Error);
}

TEST_F(TrainingData, MeanMapsAverageWhatIsKnownAndSurviveTheFile) {
  const auto names = name_views({folder.path().string()}, "train");
  MeanMaps means;
  std::vector<PreparedView> views;
  for (const ViewName& name : names) {
    views.push_back(prepare_view(read_view(name.room, name.id), 40, 30));
    means.add(views.back());
  }
  const MapSet maps = means.maps(40, 30);
  double roughness = 0, log_depth = 0;
  for (const PreparedView& v : views) {
    roughness += v.truth.material.at(0, 12, 9) / 6;
    log_depth += std::log(v.truth.depth.at(0, 12, 9)) / 6;
  }
  EXPECT_NEAR(maps.material.at(0, 12, 9), roughness, 4 * kFloatRounding);
  EXPECT_NEAR(maps.depth.at(0, 12, 9), std::exp(log_depth), 4 * kFloatRounding);
  const Vec3 n(maps.normal.at(0, 9, 9), maps.normal.at(1, 9, 9), maps.normal.at(2, 9, 9));
  EXPECT_NEAR(glm::length(n), 1, 4 * kFloatRounding);

  TensorFile file;
  means.store(file);
  const MeanMaps back = MeanMaps::restore(file, "test");
  EXPECT_EQ(back.views(), 6);
  const MapSet again = back.maps(40, 30);
  EXPECT_EQ(again.albedo.data, maps.albedo.data);
  EXPECT_EQ(back.as_stored().maps(64, 48).depth.data, back.maps(64, 48).depth.data);  // nothing is lost the second time
  file.tensors["mean_maps.mean"].shape = {9, 30};
  EXPECT_THROW(MeanMaps::restore(file, "test"), Error);
  EXPECT_THROW(MeanMaps().maps(4, 3), Error);
}

}  // namespace
}  // namespace clerestory
