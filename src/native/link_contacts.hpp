// Which contacts mechanisms solve (dynamics/link_contact.hpp), and where their rows are.
//
// Those of a link with an obstacle: what it meets that can be pushed may belong to another thread's mechanism.
#pragma once

#include <cstdint>
#include <fathom/world.hpp>
#include <span>
#include <vector>

#include "dynamics/link_contact.hpp"
#include "native/constraint_fields.hpp"
#include "native/constraint_layout.hpp"
#include "native/contact_graph.hpp"
#include "native/solver_kernels.hpp"

namespace fathom::native {

/// Numbers of chosen contacts.
struct LinkContactRange {
  std::uint32_t first = 0, end = 0;
};

class LinkContacts {
 public:
  LinkContacts(const WorldDef& def, const BodyTable& bodies, BodyState& state, const ContactGraph& graph)
      : def_(def), bodies_(bodies), state_(state), graph_(graph) {}

  /// Finds the links' contacts in the layout. `mechanisms`: their number.
  void list(const ConstraintLayout& layout, std::span<const MechanismLink> links, std::size_t mechanisms);
  /// Chooses by the loads of the last step.
  void choose(std::span<const MechanismLink> links);

  bool empty() const { return listed_.empty(); }
  bool has(std::uint32_t mechanism) const { return of_mechanism_[mechanism].end > 0; }
  bool has_link(std::uint32_t i) const { return links_[i].contacts.end > 0; }
  /// Whether the link, or one below it, has any.
  bool leads(std::uint32_t i) const { return links_[i].leads; }
  /// Whether the body is a link with any.
  bool is_loaded(std::uint32_t slot) const {
    return slot < link_of_.size() && link_of_[slot] != none && has_link(link_of_[slot]);
  }

  /// Reads the mechanism's rows, once blocks are prepared. `h`: a substep (s).
  void read(std::uint32_t mechanism, const BlockArray& blocks, float h);
  /// Moves its obstacles by a substep.
  void move_obstacles(std::uint32_t mechanism, float h);
  void load_impulses(std::uint32_t mechanism);
  void store_impulses(std::uint32_t mechanism, bool ends_substep);
  /// Sweeps over a link's contacts; see `sweep_link_contact`.
  template <ContactPass pass>
  Wrench sweep(std::uint32_t i, ContactBody<LinkResponse>& link) {
    const float lead = friction_lead(def_.solver, def_.dt / static_cast<float>(def_.solver.substeps));
    Wrench sum;
    for (std::uint32_t k = links_[i].contacts.first; k < links_[i].contacts.end; ++k)
      sum += sweep_link_contact<pass>(chosen_[k].contact, link, lead);
    return sum;
  }

  std::size_t memory_bytes() const {
    return listed_.capacity() * sizeof(Listed) + chosen_.capacity() * sizeof(Chosen) +
           links_.capacity() * sizeof(Link) + link_of_.capacity() * sizeof(std::uint32_t) +
           of_mechanism_.capacity() * sizeof(LinkContactRange);
  }

 private:
  struct Listed {
    std::uint32_t mechanism, link, contact, lane;
  };
  struct Chosen {
    Listed at;
    LinkContact contact;
    LaneFields fields;
    float sum;  ///< N·s, of the points before the present sweep
  };
  struct Link {
    LinkContactRange contacts;
    bool leads = false;
  };
  template <class Act>
  void for_each(std::uint32_t mechanism, const Act& act) {
    for (std::uint32_t k = of_mechanism_[mechanism].first; k < of_mechanism_[mechanism].end; ++k) act(chosen_[k]);
  }

  bool is_chosen(const Listed& listed, const MechanismLink& link) const;
  void read(Chosen& chosen, const BlockArray& blocks, float h);

  const WorldDef& def_;
  const BodyTable& bodies_;
  BodyState& state_;
  const ContactGraph& graph_;
  std::vector<Listed> listed_;  // by mechanism, link and contact
  std::vector<Chosen> chosen_;
  std::vector<Link> links_;
  std::vector<std::uint32_t> link_of_;  // by slot of a body
  std::vector<LinkContactRange> of_mechanism_;
};

}  // namespace fathom::native
