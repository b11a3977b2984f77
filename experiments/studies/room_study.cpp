#include "experiments/studies/room_study.hpp"

namespace clerestory {

void RoomStudy::measure_rooms(const std::function<RoomFindings(const ListedRoom& room)>& measure_room) {
  each_room([&](const ListedRoom& room) { add_record({room.index + 1, 0, measure_room(room).values()}); });
  for (const MetricRecord& record : records_) found_.add_room(record, run_.metrics_path().string());
}

}  // namespace clerestory
