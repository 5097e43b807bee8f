// Asks the application about contacts before they are solved (PreSolveContact).
//
// One thread asks between the narrow phase and the graph. A refused contact ends or does not begin: solver, events,
// islands and snapshots know nothing of disabled contacts. The application's friction and restitution go to the
// manifold, the surface slide to the graph. They last until the contact is asked about again or its materials are mixed
// again.
#pragma once

#include <cstdint>
#include <vector>

#include "native/asked_contact.hpp"
#include "native/body_state.hpp"
#include "native/contact_changes.hpp"
#include "native/contact_graph.hpp"
#include "world/body_table.hpp"
#include "world/callbacks.hpp"

namespace fathom::native {

class PreSolve {
 public:
  PreSolve(const BodyTable& bodies, const BodyState& state, ContactGraph& graph, Callbacks& callbacks)
      : bodies_(bodies), state_(state), graph_(graph), callbacks_(callbacks) {}

  /// After the narrow phase: asks about contacts that touch, then about those that begin to.
  void ask(ContactChanges& changes);
  /// Applies the answers for contacts that have begun since.
  void give_materials(std::span<const NewManifold* const> begun);
  /// Whether A may stop the fast body B. `normal` (world axes, from A to B) is for pairs that the application has not
  /// been asked about in this step.
  bool may_stop(const FastPair& pair, Vec3 normal);

  std::size_t memory_bytes() const {
    return answers_.capacity() * sizeof(Answer) + (touching_.capacity() + ended_.capacity()) * sizeof(std::uint32_t);
  }

 private:
  struct Answer : AskedContact {
    bool enabled;
    ContactMaterials materials;
  };

  bool asks(std::uint32_t a, std::uint32_t b) const { return bodies_[a].pre_solve || bodies_[b].pre_solve; }
  void list_touching();
  PreSolveContact question(const Answer& pair, Vec3 normal) const;
  Answer& answered(PreSolveContact& contact, Answer pair);
  bool keeps(std::uint32_t index);
  bool lets_begin(NewManifold& fresh);

  const BodyTable& bodies_;
  const BodyState& state_;
  ContactGraph& graph_;
  Callbacks& callbacks_;
  std::vector<Answer> answers_;  // of this step
  std::vector<std::uint32_t> touching_, ended_;
};

}  // namespace fathom::native
