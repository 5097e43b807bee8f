#include "native/thread_budget.hpp"

#include <algorithm>

#include "native/tuning.hpp"

namespace fathom::native {

int ThreadBudget::next(const StepCounts& counts, std::size_t links, double waiting, int most) {
  if (most == 1) return 1;
  const double work = work_of_body * counts.active + work_of_manifold * counts.manifolds +
                      work_of_link * static_cast<double>(links);  // s, about
  const double guess = std::max(1.0, work / ThreadChoice::worth_a_thread);
  const bool alone = work < std::max(min_work_to_share, 2 * waiting);
  return choice_.next(guess, alone ? 1 : guess, std::clamp(static_cast<int>(work / hopeless_a_thread), 1, most));
}

double ThreadBudget::waiting_in_a_heap(const ContactGraph& graph, std::size_t in_contact, std::uint32_t colours,
                                       std::uint32_t substeps) {
  if (graph.between() < in_contact || graph.domains().in_use()) return 0;
  return waiting_a_loop * (2.0 * substeps * (colours + 1) + colours);
}

}  // namespace fathom::native
