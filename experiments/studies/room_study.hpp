// A study of rooms, one after the other: one record of findings a room.
#pragma once
#include <functional>

#include "experiments/studies/findings.hpp"
#include "experiments/studies/study_run.hpp"
#include "experiments/truth/traced_room.hpp"

namespace clerestory {

class RoomStudy : public StudyRun {
 public:
  using StudyRun::StudyRun;

 protected:
  /// Calls `measure_room` for each of the first data.rooms rooms of data.list that has no record yet, and keeps what
  /// it found.
  void measure_rooms(const std::function<RoomFindings(const ListedRoom& room)>& measure_room);

  /// A room's first view, of data.width x data.height.
  TracedRoom traced_room(const ListedRoom& room) const;
  /// With its photograph, of data.spp samples.
  TracedRoom photographed(const ListedRoom& room) const;

  /// Of this run, and of those that were interrupted before; from when measure() is over.
  const Findings& found() const { return found_; }

 private:
  Findings found_;
};

}  // namespace clerestory
