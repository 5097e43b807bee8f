// How many threads the next step is worth, judged by the last one and then by measuring (threads/thread_choice.hpp).
//
// Small scenes are faster on fewer threads than there are: what one thread wrote, the next has to fetch, and threads
// wait for each other at the end of every loop.
#pragma once

#include <cstddef>
#include <fathom/profile.hpp>

#include "native/contact_graph.hpp"
#include "threads/thread_choice.hpp"

namespace fathom::native {

class ThreadBudget {
 public:
  /// Threads for the next step, of `most` that there are, where the last one counted `counts`, as many `links` of
  /// mechanisms are solved directly, and threads wait for each other for `waiting` seconds.
  int next(const StepCounts& counts, std::size_t links, double waiting, int most);
  /// That step took `seconds`.
  void took(double seconds) { choice_.took(seconds); }

  /// Seconds that threads would wait for each other, were the contacts a heap solved colour by colour, in a hundred
  /// loops or so. Islands and domains have few.
  static double waiting_in_a_heap(const ContactGraph& graph, std::size_t in_contact, std::uint32_t colours,
                                  std::uint32_t substeps);

 private:
  ThreadChoice choice_;
};

}  // namespace fathom::native
