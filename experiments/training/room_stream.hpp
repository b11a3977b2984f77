// Rooms that are made while training goes on, seen a few times and dropped.
#pragma once
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "experiments/training/view_store.hpp"
#include "tracer/generate.hpp"

namespace clerestory {

struct StreamOptions {
  bool on = false;
  GenerateOptions rooms;  // the folder, setting, seed, views a room, size, samples, light
  int times = 8;          // that a view is seen, in the mean
  int window = 48;        // rooms that are drawn from at a time
  double fixed = 0;       // share of the views that come from the fixed training rooms
  double crop_low = 1;    // a view is cut to this share of its width, at least, drawn anew each time
  int makers = 1;         // threads that make rooms, each with a queue of its own; 0: as many as makers_beside() says
  int unread = 1;         // views whose place was asked for, and whose files are not read yet: they are not dropped
  std::string device;
};

/// Whether the view at a position comes from the fixed rooms.
bool is_fixed(const StreamOptions& options, std::uint64_t seed, std::uint64_t position);
/// Rooms that have come when so many views are drawn.
std::int64_t streamed_rooms(const StreamOptions& options, std::uint64_t views);
/// Views that are drawn from at a time.
std::size_t views_in_window(const StreamOptions& options);
/// Throws usage_error where one of the judged views is of a room that the stream makes anew.
void check_not_streamed(const StreamOptions& options, const std::vector<ViewName>& judged);
/// "rooms of 2 views made on the way, each seen 8 times".
std::string stream_text(const StreamOptions& options, std::size_t fixed_views);

/// On a CPU one: nets and rooms share its cores. Beside another device a third of the host's cores; the others make
/// batches.
int makers_beside(const Device& device);

/// Which rooms are drawn from at position p is a function of p alone: the `window` rooms that begin with number
/// p / (views a room * times). Rooms are made ahead by threads with queues of their own, into a folder; those that no
/// later position needs are deleted from it. A run that goes on finds its rooms there, or makes them again, the same.
class RoomStream {
 public:
  /// Begins to make the rooms of position `first`. Throws usage_error on options out of range.
  RoomStream(const StreamOptions& options, std::uint64_t seed, std::uint64_t first);
  ~RoomStream();
  RoomStream(const RoomStream&) = delete;
  RoomStream& operator=(const RoomStream&) = delete;

  /// The view at a position, its files complete; positions do not fall. Waits for rooms that are being made, and
  /// rethrows what went wrong with them.
  ViewName at(std::uint64_t position);

  /// All views that are drawn from at a position.
  std::vector<ViewName> window(std::uint64_t position);

  /// Rooms that have come by position p.
  std::int64_t rooms(std::uint64_t position) const { return streamed_rooms(options_, position); }

 private:
  std::int64_t first_room(std::uint64_t position) const { return rooms(position) - options_.window; }
  std::int64_t unread_rooms() const { return rooms(static_cast<std::uint64_t>(options_.unread)) - options_.window; }
  std::filesystem::path folder_of(std::int64_t room) const;
  /// The oldest room that is not dropped.
  std::int64_t still_kept() const;
  /// Makes rooms until the stream ends; without a maker it opens one of its own.
  void work(std::unique_ptr<RoomMaker> maker);
  /// The next room to make, once it is wanted; none when the stream ends. Drops what is over.
  std::optional<std::int64_t> next_room();
  void has_made(std::int64_t room);
  void need(std::uint64_t position);
  void wait_for(std::int64_t room);
  ViewName view(std::uint64_t position, std::uint64_t number) const;  // of the window

  StreamOptions options_;
  std::uint64_t seed_;
  std::int64_t oldest_, wanted_, next_, made_,
      dropped_;                        // rooms: needed from, wanted below, begun, made, dropped below
  std::set<std::int64_t> made_early_;  // before one below them
  std::exception_ptr error_;
  bool stop_ = false, filled_ = false;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::thread> threads_;  // last: they use all of the above
};

}  // namespace clerestory
