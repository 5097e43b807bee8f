// How many threads the same work, done again and again, is fastest with: a first guess, corrected by measuring.
//
// What a thread more gains depends on the machine, on what else runs there, and on the scene; no rule knows all three.
// Now and then some steps are taken with half or twice as many threads, with one, or, where there is one, with the
// guess, and the choice moves there where those were faster than the steps before and the steps after. Only results
// that do not depend on the number of threads allow this.
//
// * Trials get rare: each that fails doubles the pause before the next, up to a thousand steps. One that is clearly
//   slower ends after two to four steps, so that all of them cost less than 1 % of a long run.
// * A step that takes long is never tried with other numbers: more threads are worth while then, and half of them would
//   be a spike. So would one thread where the work is estimated to take it more than twice as long.
// * Medians before and after, and a margin, keep noise from deciding; where two numbers are equally good, it stays.
#pragma once

#include <array>
#include <cstddef>

namespace fathom {

class ThreadChoice {
 public:
  /// Threads for the coming step, of `most` ≥ 1 that are possible. The work is enough for `guess` > 0 of them, each
  /// having `worth_a_thread` to do, which may be more than there are; `start` is what to begin with. The guess is
  /// followed when it changes by more than a quarter; what was measured is kept as the choice's ratio to it.
  int next(double guess, double start, int most);
  /// That step took `seconds`.
  void took(double seconds);

  /// What one thread does in this time (s) is worth having it.
  static constexpr double worth_a_thread = 20e-6;
  /// Steps longer than this (s) are left alone.
  static constexpr double longest = 1e-3;
  /// Steps before the first trial, and between later ones.
  static constexpr int first_pause = 24, shortest_pause = 128, longest_pause = 1024;

 private:
  static constexpr std::size_t samples = 5;
  static constexpr int settling = 2;       // steps after a change, in which bodies move to other threads' caches
  static constexpr double margin = 0.95;   // of the time before and after
  static constexpr double hopeless = 1.1;  // of the time before, twice
  static constexpr double absurd = 1.5;    // of the time before, although not settled
  static constexpr double spike = 2;       // of the time before, by the guess

  enum class Phase { steady, trial, check };
  /// A leap, to one thread or to the guess, may land where a few steps would not lead: two threads that wait for each
  /// other can be slower than one and slower than eight.
  enum class Way { half, twice, leap };

  void follow(double guess, double start, int most);
  static Way after(Way way);
  int candidate(int most) const;
  void begin_trial(int most);
  void end_trial(bool successful);
  void enter(Phase phase);
  double median() const;

  Phase phase_ = Phase::steady;
  Way way_ = Way::half;  // of this trial or the next
  int choice_ = 0;
  double guess_ = 0;       // that the choice follows
  double correction_ = 1;  // of the guess, measured
  bool measured_ = false;  // else it starts with what it is told
  int candidate_ = 0;      // in a trial
  int pause_ = first_pause, wait_ = first_pause;
  int settling_ = 0;
  std::array<double, samples> seconds_{};  // of the phase's last steps
  std::size_t count_ = 0;                  // of the phase's steps
  double before_ = 0, tried_ = 0;          // medians (s)
};

}  // namespace fathom
