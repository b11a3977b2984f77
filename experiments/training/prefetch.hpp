// Batches made ahead of time on a thread of their own.
#pragma once
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>

namespace clerestory {

inline constexpr int kBatchesAhead = 3;

template <class Batch>
class Prefetch {
 public:
  /// `make`(step) is called for first_step, first_step + 1, ..., by one thread; `ahead` results wait at most.
  Prefetch(std::function<Batch(std::int64_t)> make, std::int64_t first_step, std::size_t ahead = kBatchesAhead)
      : make_(std::move(make)), ahead_(ahead), thread_([this, first_step] { work(first_step); }) {}

  ~Prefetch() {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }
  Prefetch(const Prefetch&) = delete;
  Prefetch& operator=(const Prefetch&) = delete;

  /// Batches in order; rethrows what went wrong while making one. Not to be called again after that.
  Batch next() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return !ready_.empty() || error_; });
    if (ready_.empty()) std::rethrow_exception(error_);
    Batch batch = std::move(ready_.front());
    ready_.pop_front();
    changed_.notify_all();
    return batch;
  }

 private:
  void work(std::int64_t step) {
    try {
      for (;; ++step) {
        {
          std::unique_lock lock(mutex_);
          changed_.wait(lock, [&] { return stop_ || ready_.size() < ahead_; });
          if (stop_) return;
        }
        Batch batch = make_(step);
        const std::lock_guard lock(mutex_);
        ready_.push_back(std::move(batch));
        changed_.notify_all();
      }
    } catch (...) {
      const std::lock_guard lock(mutex_);
      error_ = std::current_exception();
      changed_.notify_all();
    }
  }

  std::function<Batch(std::int64_t)> make_;
  std::size_t ahead_;
  std::deque<Batch> ready_;
  std::exception_ptr error_;
  bool stop_ = false;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::thread thread_;  // last: it uses all of the above
};

}  // namespace clerestory
