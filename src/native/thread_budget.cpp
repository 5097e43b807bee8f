#include "native/thread_budget.hpp"

#include <algorithm>

#include "native/tuning.hpp"

namespace fathom::native {

int ThreadBudget::next(const StepCounts& counts, Joints joints, double waiting, int most) {
  if (most == 1) return 1;
  estimate_ = work_of_body * counts.active + work_of_manifold * counts.manifolds +
              work_of_joint * static_cast<double>(joints.joints) + work_of_link * static_cast<double>(joints.links);
  const double work = underestimated() * estimate_;  // s, about
  const double guess = std::max(1.0, work / ThreadChoice::worth_a_thread);
  const bool alone = work < std::max(min_work_to_share, 2 * waiting);
  const double worth_trying = std::clamp(work / hopeless_a_thread, 1.0, static_cast<double>(most));
  threads_ = choice_.next(guess, alone ? 1 : guess, static_cast<int>(worth_trying));
  return threads_;
}

void ThreadBudget::took(double seconds) {
  choice_.took(seconds);
  if (threads_ != 1) return;
  // Shorter steps are tried on more threads anyway.
  const bool is_long = seconds > ThreadChoice::longest && estimate_ > 0;
  ratios_[measured_++ % ratios_.size()] = is_long ? seconds / estimate_ : 1;
}

double ThreadBudget::underestimated() const {
  return measured_ < ratios_.size() ? 1 : std::max(1.0, *std::ranges::min_element(ratios_));
}

double ThreadBudget::waiting_in_a_heap(const ContactGraph& graph, std::size_t in_contact, std::uint32_t colours,
                                       std::uint32_t substeps) {
  if (graph.between() < in_contact || graph.domains().in_use()) return 0;
  return waiting_a_loop * (2.0 * substeps * (colours + 1) + colours);
}

}  // namespace fathom::native
