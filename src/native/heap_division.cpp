#include "native/heap_division.hpp"

#include <algorithm>
#include <iterator>
#include <vector>

#include "native/tuning.hpp"

namespace fathom::native {

void HeapDivision::update(ContactGraph& graph, std::span<const std::uint32_t> active, std::size_t in_contact,
                          const BodyState& state, ThreadPool& pool) {
  const std::size_t contacts = graph.between();
  if (!graph.domains().in_use()) {
    if (contacts >= min_to_divide && contacts >= in_contact) divide(graph, active, state, pool);
    return;
  }
  if (2 * contacts < min_to_divide || 2 * contacts < in_contact) {
    graph.divide({}, pool);
    return;
  }
  const Cost now = cost_of(graph), then = cost_when_divided_;
  if (now.contacts > 2 * then.contacts || 2 * now.contacts < then.contacts ||
      4 * now.sweep * then.contacts > 5 * then.sweep * now.contacts)
    divide(graph, active, state, pool);
}

void HeapDivision::divide(ContactGraph& graph, std::span<const std::uint32_t> active, const BodyState& state,
                          ThreadPool& pool) {
  std::vector<std::uint32_t> dynamic;
  dynamic.reserve(active.size());
  std::ranges::copy_if(active, std::back_inserter(dynamic),
                       [&](std::uint32_t slot) { return !(state.flags[slot] & kinematic); });
  graph.divide(dynamic, pool);
  cost_when_divided_ = cost_of(graph);
}

// Duration of a sweep, in contacts that one thread solves, with as many threads as domains; times that number.
HeapDivision::Cost HeapDivision::cost_of(const ContactGraph& graph) {
  const Domains& domains = graph.domains();
  Cost cost{0, graph.between()};
  for (std::size_t division = 0; division < Domains::divisions; ++division) {
    std::size_t largest = 0;
    for (std::size_t i = 0; i < domains.count(division); ++i)
      largest = std::max(largest, graph.size_of_unit(domains.first_unit(division) + i));
    cost.sweep += largest * domains.count(0);
  }
  cost.sweep += graph.size_of_unit(domains.remainder()) * domains.count(0);
  return cost;
}

}  // namespace fathom::native
