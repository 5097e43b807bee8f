// Decides when a large heap is divided into domains, and when the domains are redrawn.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "native/body_state.hpp"
#include "native/contact_graph.hpp"
#include "threads/thread_pool.hpp"

namespace fathom::native {

/// Domains are redrawn when motion has made a sweep a quarter longer, or the number of contacts has doubled or halved.
class HeapDivision {
 public:
  /// `in_contact`: those of the `active` bodies that the solver moves.
  void update(ContactGraph& graph, std::span<const std::uint32_t> active, std::size_t in_contact,
              const BodyState& state, ThreadPool& pool);

  template <class Self, class Archive>
  static void archive(Self& self, Archive& archive) {
    archive(self.cost_when_divided_);
  }

 private:
  struct Cost {
    std::uint64_t sweep = 0, contacts = 0;
  };
  static Cost cost_of(const ContactGraph& graph);
  void divide(ContactGraph& graph, std::span<const std::uint32_t> active, const BodyState& state, ThreadPool& pool);

  Cost cost_when_divided_;
};

}  // namespace fathom::native
