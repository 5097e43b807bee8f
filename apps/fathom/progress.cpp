#include "progress.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "measure/system.hpp"

namespace fathom::cli {
namespace {

constexpr int widest_bar = 30;
constexpr std::chrono::milliseconds redraw_interval{100};

std::string remaining_time(double seconds) {
  const auto s = static_cast<std::uint64_t>(std::llround(seconds));
  if (s >= 3600) return fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
  return fmt::format("{}:{:02}", s / 60, s % 60);
}

/// The bar, as wide as the text leaves room; empty if that is too little.
std::string bar(double share, std::size_t text) {
  const int room = static_cast<int>(terminal_columns()) - static_cast<int>(text) - 4;
  const int width = std::min(widest_bar, room), filled = static_cast<int>(share * width);
  return width < 5 ? std::string() : fmt::format("[{:=<{}}{: <{}}] ", "", filled, "", width - filled);
}

}  // namespace

Progress::Progress(std::uint64_t steps, bool on) : steps_(steps), on_(on), start_(Clock::now()), drawn_(start_) {}

Progress::~Progress() {
  if (on_) tell("\r\033[K");
}

void Progress::update(std::uint64_t done) {
  if (!on_) return;
  const Clock::time_point now = Clock::now();
  if (now - drawn_ < redraw_interval) return;
  drawn_ = now;
  draw(done, std::chrono::duration<double>(now - start_).count());
}

void Progress::draw(std::uint64_t done, double seconds) const {
  const double share = static_cast<double>(done) / static_cast<double>(steps_);
  const double rate = static_cast<double>(done) / seconds;
  const std::string text = fmt::format("{:3.0f} %  step {} of {}  {:.0f} steps/s  {} left", 100 * share, done, steps_,
                                       rate, remaining_time(static_cast<double>(steps_ - done) / rate));
  tell(fmt::format("\r{}\033[K", fit_to_terminal(bar(share, text.size()) + text)));
  std::fflush(stderr);
}

}  // namespace fathom::cli
