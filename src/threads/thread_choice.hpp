// How many threads the same work, done again and again, is fastest with: a first guess, corrected by measuring.
//
// What a thread more gains depends on the machine, on what else runs there, and on the scene; no rule knows all three.
// Now and then some steps are taken with half or twice as many threads, and the choice moves there where those were
// faster than the steps before and the steps after. Only results that do not depend on the number of threads allow
// this.
//
// * Trials get rare: each that fails doubles the pause before the next, up to a thousand steps. One that is clearly
//   slower ends after four steps, so that all of them cost less than 1 % of a long run.
// * A step that takes long is never tried with other numbers: more threads are worth while then, and half of them would
//   be a spike.
// * Medians before and after, and a margin, keep noise from deciding; where two numbers are equally good, it stays.
#pragma once

#include <array>
#include <cstddef>

namespace fathom {

class ThreadChoice {
 public:
  /// Threads for the coming step. `guess` > 0 of them seem worth while; `most` ≥ 1 are possible. The guess is followed
  /// when it changes by more than a quarter; what was measured is kept as its ratio to the guess.
  int next(double guess, int most);
  /// That step took `seconds`.
  void took(double seconds);

  /// Steps longer than this (s) are left alone.
  static constexpr double longest = 1e-3;
  /// Steps before the first trial, and between later ones.
  static constexpr int first_pause = 24, shortest_pause = 128, longest_pause = 1024;

 private:
  static constexpr std::size_t samples = 5;
  static constexpr int settling = 2;       // steps after a change, in which bodies move to other threads' caches
  static constexpr double margin = 0.95;   // of the time before and after
  static constexpr double hopeless = 1.1;  // of the time before, twice

  enum class Phase { steady, trial, check };

  void follow(double guess, int most);
  void begin_trial(int most);
  void end_trial(bool successful);
  void enter(Phase phase);
  double median() const;

  Phase phase_ = Phase::steady;
  int choice_ = 0;
  double guess_ = 0;       // that the choice follows
  double correction_ = 1;  // of the guess, measured
  int candidate_ = 0;      // in a trial
  bool fewer_ = true;      // the next trial's direction
  int pause_ = first_pause, wait_ = first_pause;
  int settling_ = 0;
  std::array<double, samples> seconds_{};  // of the phase's last steps
  std::size_t count_ = 0;                  // of the phase's steps
  double before_ = 0, tried_ = 0;          // medians (s)
};

}  // namespace fathom
