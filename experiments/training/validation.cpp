#include "experiments/training/validation.hpp"

namespace clerestory {

std::vector<std::size_t> spread(std::size_t total, std::size_t count) {
  if (count == 0 || count > total) count = total;
  std::vector<std::size_t> which;
  for (std::size_t i = 0; i < count; ++i) which.push_back(i * total / count);
  return which;
}

std::vector<JudgedView> read_for_judgement(ViewStore& store, const std::vector<std::size_t>& which,
                                           const MapSet* means) {
  std::vector<JudgedView> views;
  for (const std::size_t i : which) {
    PreparedView view = store.get(i);
    ViewResult result = trivial_errors(store.name(i).text(), view, means);
    views.push_back({std::move(view), std::move(result)});
  }
  return views;
}

void judge_all(std::vector<JudgedView>& views, MapPredictor& predictor) {
  std::vector<const Image*> pictures;
  for (const JudgedView& v : views) pictures.push_back(&v.view.image);
  const std::vector<MapPrediction> predictions = predictor.predict(pictures);
  for (std::size_t i = 0; i < views.size(); ++i)
    judge(views[i].result, views[i].view, predictions[i].maps, predictions[i].log_scale);
}

JudgedFrame read_frame(const std::filesystem::path& folder, int longer) {
  RgbdFrame frame = read_rgbd(folder);
  const std::filesystem::path name = folder.has_filename() ? folder.filename() : folder.parent_path().filename();
  return {name.string(), prepare_photo(frame.photo.image, longer), std::move(frame.depth)};
}

FrameResult judge(const JudgedFrame& frame, MapPredictor& predictor, const std::optional<MeanMaps>& means) {
  const MapPrediction prediction = predictor.predict({&frame.picture}).front();
  const std::optional<MapSet> mean =
      means ? std::optional(means->maps(frame.picture.width, frame.picture.height)) : std::nullopt;
  return judge_frame(frame.name, prediction.maps.depth, prediction.log_scale, frame.depth, mean ? &*mean : nullptr);
}

std::vector<ViewResult> results_of(const std::vector<JudgedView>& views) {
  std::vector<ViewResult> results;
  for (const JudgedView& v : views) results.push_back(v.result);
  return results;
}

}  // namespace clerestory
