#include "threads/thread_choice.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace fathom {

int ThreadChoice::next(double guess, int most) {
  follow(std::clamp(guess, 1.0, static_cast<double>(most)), most);
  if (phase_ == Phase::steady && wait_ <= 0 && count_ >= samples && median() < longest) begin_trial(most);
  return std::min(phase_ == Phase::trial ? candidate_ : choice_, most);
}

void ThreadChoice::follow(double guess, int most) {
  if (std::abs(guess - guess_) > 0.25 * guess_) guess_ = guess;
  const int choice = std::clamp(static_cast<int>(std::lround(correction_ * guess_)), 1, most);
  if (choice == choice_) return;
  choice_ = choice;
  pause_ = wait_ = first_pause;
  enter(Phase::steady);
}

void ThreadChoice::begin_trial(int most) {
  const int less = std::max(1, choice_ / 2), more = std::min(most, 2 * choice_);
  if (fewer_ ? less == choice_ : more == choice_) fewer_ = !fewer_;
  candidate_ = fewer_ ? less : more;
  if (candidate_ == choice_) return;
  before_ = median();
  enter(Phase::trial);
}

void ThreadChoice::took(double seconds) {
  if (settling_ > 0) {
    --settling_;
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

// What was worth while is worth going on with; else the other direction is next.
void ThreadChoice::end_trial(bool successful) {
  if (successful) {
    choice_ = candidate_;
    correction_ = choice_ / guess_;
    wait_ = first_pause;
  } else {
    fewer_ = !fewer_;
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
