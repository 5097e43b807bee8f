#include "threads/thread_choice.hpp"

#include <algorithm>
#include <cmath>

namespace fathom {

namespace {

int whole(double threads, int most) { return static_cast<int>(std::lround(std::clamp<double>(threads, 1, most))); }

}  // namespace

int ThreadChoice::next(double guess, double start, int most) {
  follow(guess, start, most);
  if (phase_ == Phase::steady && wait_ <= 0 && count_ >= samples && median() < longest) begin_trial(most);
  return std::min(phase_ == Phase::trial ? candidate_ : choice_, most);
}

void ThreadChoice::follow(double guess, double start, int most) {
  if (std::abs(guess - guess_) > 0.25 * guess_) {
    guess_ = guess;
    if (!measured_) correction_ = start / guess;
  }
  const int choice = whole(correction_ * guess_, most);
  if (choice == choice_) return;
  choice_ = choice;
  way_ = choice > 1 ? Way::half : Way::leap;
  pause_ = wait_ = first_pause;
  enter(Phase::steady);
}

int ThreadChoice::candidate(int most) const {
  switch (way_) {
    case Way::half:
      return std::max(1, choice_ / 2);
    case Way::twice:
      return std::min(most, 2 * choice_);
    default:
      if (choice_ == 1) return whole(guess_, most);
      return worth_a_thread * guess_ > spike * median() ? choice_ : 1;
  }
}

ThreadChoice::Way ThreadChoice::after(Way way) {
  return way == Way::half ? Way::twice : way == Way::twice ? Way::leap : Way::half;
}

void ThreadChoice::begin_trial(int most) {
  for (int ways = 0; ways < 3 && candidate(most) == choice_; ++ways) way_ = after(way_);
  candidate_ = candidate(most);
  if (candidate_ == choice_) return;
  before_ = median();
  enter(Phase::trial);
}

void ThreadChoice::took(double seconds) {
  if (settling_ > 0) {
    if (--settling_ == 0 && phase_ == Phase::trial && seconds > absurd * before_) end_trial(false);
    return;
  }
  seconds_[count_++ % samples] = seconds;
  if (phase_ == Phase::steady) {
    --wait_;
  } else if (phase_ == Phase::trial) {
    if (count_ == 2 && std::min(seconds_[0], seconds_[1]) > hopeless * before_) {
      end_trial(false);
    } else if (count_ == samples) {
      tried_ = median();
      if (tried_ < margin * before_)
        enter(Phase::check);
      else
        end_trial(false);
    }
  } else if (count_ == samples) {
    end_trial(tried_ < margin * median());
  }
}

// After a success the next trial continues in the same direction.
void ThreadChoice::end_trial(bool successful) {
  if (successful) {
    choice_ = candidate_;
    correction_ = choice_ / guess_;
    measured_ = true;
    wait_ = first_pause;
    if (way_ == Way::leap) way_ = after(way_);
  } else {
    way_ = after(way_);
    wait_ = pause_ = std::clamp(2 * pause_, shortest_pause, longest_pause);
  }
  enter(Phase::steady);
}

void ThreadChoice::enter(Phase phase) {
  phase_ = phase;
  count_ = 0;
  settling_ = settling;
}

double ThreadChoice::median() const {
  std::array<double, samples> sorted = seconds_;
  std::nth_element(sorted.begin(), sorted.begin() + samples / 2, sorted.end());
  return sorted[samples / 2];
}

}  // namespace fathom
