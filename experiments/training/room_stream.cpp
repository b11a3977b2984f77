#include "experiments/training/room_stream.hpp"

#include <algorithm>

#include "experiments/training/keyed.hpp"
#include "host/error.hpp"
#include "host/report/progress.hpp"

namespace clerestory {
namespace {

constexpr int kAhead = 4;                          // rooms made beyond those that are drawn from, a maker
constexpr int kBehind = 2;                         // windows kept behind it, for a run that goes on from a checkpoint
constexpr std::uint64_t kViewDraw = 0x726f6f6d73;  // purpose of the draw of a view
constexpr std::uint64_t kFixedDraw = 0x6669786564;

}  // namespace

bool is_fixed(const StreamOptions& options, std::uint64_t seed, std::uint64_t position) {
  return keyed_uniform(seed, position, kFixedDraw) < options.fixed;
}

std::int64_t streamed_rooms(const StreamOptions& options, std::uint64_t views) {
  return options.window +
         static_cast<std::int64_t>(views / static_cast<std::uint64_t>(options.rooms.views.count * options.times));
}

std::size_t views_in_window(const StreamOptions& options) {
  return static_cast<std::size_t>(options.window * options.rooms.views.count);
}

void check_not_streamed(const StreamOptions& options, const std::vector<ViewName>& judged) {
  if (!options.on) return;
  const std::string any = room_name(options.rooms, 0), of_seed = any.substr(0, any.rfind('-') + 1);
  for (const ViewName& view : judged)
    if (view.room.filename().string().starts_with(of_seed))
      throw usage_error("rooms that are judged would be made again, and trained on", "stream.seed",
                        fmt::format("{}: {}", options.rooms.rooms.seed, view.room.string()), "a seed of its own");
}

std::string stream_text(const StreamOptions& options, std::size_t fixed_views) {
  const std::string streamed =
      fmt::format("rooms of {} views made on the way, each seen {} times", options.rooms.views.count, options.times);
  if (options.fixed == 0) return streamed;
  return fmt::format("{}, {:.0f} % of the views from {} in folders", streamed, 100 * options.fixed, fixed_views);
}

int makers_beside(const Device& device) {
  return device.info().cpu ? 1 : std::max(1, static_cast<int>(std::thread::hardware_concurrency()) / 3);
}

RoomStream::RoomStream(const StreamOptions& options, std::uint64_t seed, std::uint64_t first)
    : options_(options),
      seed_(seed),
      oldest_(first_room(first)),
      wanted_(rooms(first)),
      next_(oldest_),
      made_(oldest_),
      dropped_(std::max<std::int64_t>(0, still_kept())) {
  // The index of a room has no end; the bound that a set has is of no use here.
  options_.rooms.rooms.count = 1000000;
  options_.rooms.interrupted = [this] {
    const std::lock_guard lock(mutex_);
    return stop_;
  };
  for (std::int64_t room = 0; room < dropped_; ++room)  // what an earlier try kept behind it
    std::filesystem::remove_all(folder_of(room));
  const Device device = Device::open(options_.device);
  if (options_.makers == 0) options_.makers = makers_beside(device);
  auto maker = std::make_unique<RoomMaker>(device, options_.rooms);  // says what is wrong with the options
  threads_.emplace_back([this, one = std::move(maker)]() mutable { work(std::move(one)); });
  for (int i = 1; i < options_.makers; ++i) threads_.emplace_back([this] { work(nullptr); });
}

RoomStream::~RoomStream() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

std::filesystem::path RoomStream::folder_of(std::int64_t room) const {
  return options_.rooms.out / room_name(options_.rooms, static_cast<int>(room));
}

std::int64_t RoomStream::still_kept() const { return oldest_ - kBehind * options_.window - unread_rooms(); }

std::optional<std::int64_t> RoomStream::next_room() {
  std::int64_t room = 0, dropped = 0, oldest = 0;
  {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return stop_ || error_ || next_ < wanted_ + kAhead * options_.makers; });
    if (stop_ || error_) return std::nullopt;
    room = next_++, dropped = dropped_;
    oldest = std::max(dropped, still_kept());
    dropped_ = oldest;
  }
  for (; dropped < oldest; ++dropped) std::filesystem::remove_all(folder_of(dropped));
  return room;
}

void RoomStream::has_made(std::int64_t room) {
  const std::lock_guard lock(mutex_);
  made_early_.insert(room);
  while (made_early_.erase(made_) > 0) ++made_;
  changed_.notify_all();
}

void RoomStream::work(std::unique_ptr<RoomMaker> maker) {
  try {
    if (!maker) maker = std::make_unique<RoomMaker>(Device::open(options_.device), options_.rooms);
    GenerateSummary summary;
    while (const std::optional<std::int64_t> room = next_room()) {
      maker->make(static_cast<int>(*room), summary);
      has_made(*room);
    }
  } catch (...) {
    const std::lock_guard lock(mutex_);
    if (!error_) error_ = std::current_exception();
    changed_.notify_all();
  }
}

void RoomStream::wait_for(std::int64_t room) {
  std::unique_lock lock(mutex_);
  const std::int64_t from = made_;
  if (from > room && !error_) return;
  Progress bar("rooms", room + 1 - from, "rooms");
  while (made_ <= room && !error_) {
    changed_.wait_for(lock, std::chrono::milliseconds(200));
    bar.update(std::min(made_, room + 1) - from);
    if (!filled_) stop_if_interrupted("train");  // later the batch that is waited for comes first
  }
  if (error_) std::rethrow_exception(error_);
  filled_ = true;
}

void RoomStream::need(std::uint64_t position) {
  {
    const std::lock_guard lock(mutex_);
    oldest_ = first_room(position), wanted_ = rooms(position);
  }
  changed_.notify_all();
  wait_for(rooms(position) - 1);
}

ViewName RoomStream::view(std::uint64_t position, std::uint64_t number) const {
  const auto views = static_cast<std::uint64_t>(options_.rooms.views.count);
  const auto room = static_cast<int>(first_room(position) + static_cast<std::int64_t>(number / views));
  return {options_.rooms.out / room_name(options_.rooms, room), view_id(static_cast<int>(number % views))};
}

ViewName RoomStream::at(std::uint64_t position) {
  need(position);
  return view(position, keyed_bits(seed_, position, kViewDraw) % views_in_window(options_));
}

std::vector<ViewName> RoomStream::window(std::uint64_t position) {
  need(position);
  std::vector<ViewName> views;
  for (std::size_t i = 0; i < views_in_window(options_); ++i) views.push_back(view(position, i));
  return views;
}

}  // namespace clerestory
