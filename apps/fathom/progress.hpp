// A progress bar with rate and remaining time.
#pragma once

#include <chrono>
#include <cstdint>

namespace fathom::cli {

/// Draws on stderr, at most ten times per second, and clears the line at the end. Does nothing if it is off.
class Progress {
 public:
  Progress(std::uint64_t steps, bool on);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void update(std::uint64_t done);

 private:
  using Clock = std::chrono::steady_clock;

  void draw(std::uint64_t done, double seconds) const;

  std::uint64_t steps_;
  bool on_;
  Clock::time_point start_;
  Clock::time_point drawn_;
};

}  // namespace fathom::cli
