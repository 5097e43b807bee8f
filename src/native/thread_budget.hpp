// How many threads the next step is worth, judged by the last one and then by measuring (threads/thread_choice.hpp).
//
// Small scenes are faster on fewer threads than there are: what one thread wrote, the next has to fetch, and threads
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
  /// Threads for the next step, of `most` that there are, where the last one counted `counts`, and threads wait for
  /// each other for `waiting` seconds.
  int next(const StepCounts& counts, Joints joints, double waiting, int most);
  /// That step took `seconds`.
  void took(double seconds);

  /// Seconds that threads would wait for each other, were the contacts a heap solved colour by colour, in a hundred
  /// loops or so. Islands and domains have few.
  static double waiting_in_a_heap(const ContactGraph& graph, std::size_t in_contact, std::uint32_t colours,
                                  std::uint32_t substeps);

 private:
  /// How many times as long as estimated the last steps on one thread were: hulls, long searches.
  double underestimated() const;

  ThreadChoice choice_;
  int threads_ = 0;      // of the step under way
  double estimate_ = 0;  // s
  /// Measured time by estimate, of the last steps on one thread. The minimum counts: a thread may be interrupted.
  std::array<double, 3> ratios_{};
  std::size_t measured_ = 0;
};

}  // namespace fathom::native
