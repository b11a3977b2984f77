#include "experiments/training/task.hpp"

#include <set>

namespace clerestory {

void add_list(Judgement& judgement, const std::string& list, std::size_t views, const HistoryPoint& point) {
  judgement.point.lists.push_back(list_errors(list, static_cast<std::int64_t>(views), point));
  judgement.values.emplace_back("list/" + list, point.score);
  judgement.text += fmt::format("; {} {:.3f}", list, point.score);
}

TrainingData data_of(const TrainingOptions& options, const std::vector<ViewName>& fixed, std::int64_t step) {
  std::set<std::string> rooms;
  for (const ViewName& name : fixed) rooms.insert(name.room.string());
  TrainingData data{static_cast<std::int64_t>(rooms.size()), static_cast<std::int64_t>(fixed.size())};
  if (!options.data.stream.on) return data;
  const std::int64_t streamed =
      streamed_rooms(options.data.stream, static_cast<std::uint64_t>(step * options.train.batch));
  return {data.rooms + streamed, data.views + streamed * options.data.stream.rooms.views.count};
}

std::vector<ViewName> fixed_names(const TrainingOptions& options) {
  if (options.data.stream.on && options.data.stream.fixed == 0) return {};
  return name_views(options.data.train_roots, options.data.train_split);
}

std::string data_text(const TrainingOptions& options, std::size_t fixed) {
  return options.data.stream.on ? stream_text(options.data.stream, fixed) : fmt::format("{} training views", fixed);
}

}  // namespace clerestory
