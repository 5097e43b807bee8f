// Finds the fastest number of threads for repeated work: a first guess, corrected by measurement.
//
// The gain of another thread depends on the machine, its other load and the scene; no rule knows all three. From time
// to time some steps run with half or twice as many threads, with one, or, if one is in use, with the guess. The choice
// moves there if those steps were faster than the steps before and after. Results must not depend on the number of
// threads.
//
// * Trials become rare: each failure doubles the pause before the next, up to a thousand steps. A trial that is clearly
//   slower ends after two to four steps, so all of them cost less than 1 % of a long run.
// * Long steps have no trials: more threads are worthwhile then, and half as many would be a spike. So would a single
//   thread if, by estimate, it would take more than twice as long.
// * Medians before and after, and a margin, suppress noise; if two numbers are equally good, the choice stays.
#pragma once

#include <array>
#include <cstddef>

namespace fathom {

class ThreadChoice {
 public:
  /// Threads for the next step, of `most` ≥ 1 available. The work suffices for `guess` > 0 threads, each with
  /// `worth_a_thread` to do; that may exceed `most`. `start` is the initial choice. The choice follows the guess when
  /// that changes by more than a quarter; measurements are kept as the ratio of choice to guess.
  int next(double guess, double start, int most);
  /// That step took `seconds`.
  void took(double seconds);

  /// Work of this duration (s) is worth a thread.
  static constexpr double worth_a_thread = 20e-6;
  /// Steps longer than this (s) have no trials.
  static constexpr double longest = 1e-3;
  /// Steps before the first trial, and between later ones.
  static constexpr int first_pause = 24, shortest_pause = 128, longest_pause = 1024;

 private:
  static constexpr std::size_t samples = 5;
  static constexpr int settling = 2;       // steps after a change, in which bodies migrate to other threads' caches
  static constexpr double margin = 0.95;   // relative to the time before and after
  static constexpr double hopeless = 1.1;  // relative to the time before, twice
  static constexpr double absurd = 1.5;    // relative to the time before, even while settling
  static constexpr double spike = 2;       // relative to the time before, as estimated by the guess

  enum class Phase { steady, trial, check };
  /// A leap, to one thread or to the guess, can escape a local optimum of halving and doubling: two threads that wait
  /// for each other can be slower than one and slower than eight.
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
  double guess_ = 0;       // followed by the choice
  double correction_ = 1;  // measured ratio of choice to guess
  bool measured_ = false;  // otherwise the choice begins with `start`
  int candidate_ = 0;      // in a trial
  int pause_ = first_pause, wait_ = first_pause;
  int settling_ = 0;
  std::array<double, samples> seconds_{};  // of the phase's last steps
  std::size_t count_ = 0;                  // of the phase's steps
  double before_ = 0, tried_ = 0;          // medians (s)
};

}  // namespace fathom
