// How many threads the next step is worth: estimated from the last step, then measured (threads/thread_choice.hpp).
//
// Small scenes are faster on fewer threads than are available: each thread must fetch what others wrote, and threads
// wait for each other at the end of every loop.
#pragma once

#include <array>
#include <cstddef>
#include <fathom/profile.hpp>

#include "native/contact_graph.hpp"
#include "threads/thread_choice.hpp"

namespace fathom::native {

class ThreadBudget {
 public:
  /// Joints of awake bodies, and bodies of mechanisms that are solved directly.
  struct Joints {
    std::size_t joints, links;
  };
  /// Threads for the next step, of `most` available, after a step that counted `counts`; threads wait for each other
  /// for `waiting` seconds.
  int next(const StepCounts& counts, Joints joints, double waiting, int most);
  /// That step took `seconds`.
  void took(double seconds);

  /// Seconds of waiting if the contacts are a heap solved colour by colour, in about a hundred loops. Islands and
  /// domains have few loops.
  static double waiting_in_a_heap(const ContactGraph& graph, std::size_t in_contact, std::uint32_t colours,
                                  std::uint32_t substeps);

 private:
  /// Ratio of actual to estimated time of the last steps on one thread: hulls, long searches.
  double underestimated() const;

  ThreadChoice choice_;
  int threads_ = 0;      // of the current step
  double estimate_ = 0;  // s
  /// Measured over estimated time, of the last steps on one thread. The minimum counts: a thread may be interrupted.
  std::array<double, 3> ratios_{};
  std::size_t measured_ = 0;
};

}  // namespace fathom::native
