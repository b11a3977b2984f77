#include "experiments/studies/room_study.hpp"

namespace clerestory {

void RoomStudy::measure_rooms(const std::function<RoomFindings(const ListedRoom& room)>& measure_room) {
  const std::string where = run_.metrics_path().string();
  for (const MetricRecord& record : records_) found_.add_room(record, where);
  each_room([&](const ListedRoom& room) {
    add_record({room.index + 1, 0, measure_room(room).values()});
    found_.add_room(records_.back(), where);
  });
}

TracedRoom RoomStudy::traced_room(const ListedRoom& room) const {
  return {device_, room, config_.whole("data.width"), config_.whole("data.height")};
}

TracedRoom RoomStudy::photographed(const ListedRoom& room) const {
  TracedRoom traced = traced_room(room);
  traced.take_photograph(config_.whole("data.spp"), Random(room.seed).seed(kPhotographSeed));
  return traced;
}

}  // namespace clerestory
