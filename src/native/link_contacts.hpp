// Which contacts mechanisms solve (dynamics/link_contact.hpp), and where their rows are.
//
// Those of a link with an obstacle, or with a free body: one without joints. Mechanisms that push the same free body
// are solved one after the other.
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
  /// Whether a mechanism solves the contact with this manifold in this step.
  bool is_chosen(std::uint32_t manifold) const { return manifold < is_chosen_.size() && is_chosen_[manifold]; }
  /// Whether a chosen contact may add inertia: one with a free body, which presses on it along gravity.
  bool adds_inertia(std::uint32_t manifold, Vec3 normal) const {
    return is_chosen_[manifold] == of_free && carries_weight(normal, normalize(-def_.gravity));
  }
  /// Whether the body is a link of a mechanism that stands on something: a joint holds it to an obstacle, or it solves
  /// a contact with one.
  bool stands(std::uint32_t slot) const {
    return slot < link_of_.size() && link_of_[slot] != none && links_[link_of_[slot]].stands;
  }
  /// Mechanisms that push the same free bodies, by mechanism: their smallest number and how many they are. One thread
  /// solves them, in their order.
  struct Cluster {
    std::uint32_t first, size;
  };
  const Cluster& cluster(std::uint32_t mechanism) const { return clusters_[mechanism]; }
  /// Whether the body is a link with any.
  bool is_loaded(std::uint32_t slot) const {
    return slot < link_of_.size() && link_of_[slot] != none && has_link(link_of_[slot]);
  }

  /// Reads the mechanism's rows, once blocks are prepared. `h`: a substep (s).
  void read(std::uint32_t mechanism, const BlockArray& blocks, float h);
  /// Moves its obstacles by a substep.
  void move_obstacles(std::uint32_t mechanism, float h);
  LinkContactRange of_mechanism(std::uint32_t mechanism) const { return of_mechanism_[mechanism]; }
  LinkContactRange of_link(std::uint32_t i) const { return links_[i].contacts; }
  /// Before sweeps over a link's contacts.
  void begin(std::uint32_t i, const LinkResponse& response);
  void store_impulses(LinkContactRange range, bool ends_substep);
  /// Instead: the changes do not count, and free bodies get back the velocities that they had.
  void take_back(LinkContactRange range);
  /// Sweeps over a link's contacts; see `sweep_link_contact`.
  template <ContactPass pass>
  Wrench sweep(std::uint32_t i, ContactBody<LinkResponse>& link) {
    const float lead = friction_lead(def_.solver, def_.dt / static_cast<float>(def_.solver.substeps));
    Wrench sum;
    for (std::uint32_t k = links_[i].contacts.first; k < links_[i].contacts.end; ++k) {
      LinkContact& contact = chosen_[k].contact;
      if (!contact.is_pushable) {
        sum += sweep_link_contact<pass, false>(contact, link, lead);
        continue;
      }
      load_other(chosen_[k]);
      sum += sweep_link_contact<pass, true>(contact, link, lead);
      store_other(chosen_[k]);
    }
    return sum;
  }

  std::size_t memory_bytes() const {
    return listed_.capacity() * sizeof(Listed) + chosen_.capacity() * sizeof(Chosen) +
           links_.capacity() * sizeof(Link) + link_of_.capacity() * sizeof(std::uint32_t) +
           of_mechanism_.capacity() * sizeof(LinkContactRange) + clusters_.capacity() * sizeof(Cluster) +
           is_chosen_.capacity();
  }

 private:
  enum Kind : std::uint8_t { not_chosen, of_obstacle, of_free };

  struct Listed {
    std::uint32_t mechanism, link, contact, lane;
    std::uint32_t free;  ///< slot of the body that the link touches, or `none`: an obstacle
  };
  struct Chosen {
    Listed at;
    LinkContact contact;
    LaneFields fields;
    float sum;        ///< N·s, of the points before the present sweeps
    Velocity before;  ///< of the free body, likewise
  };
  struct Link {
    LinkContactRange contacts;
    bool leads = false;
    bool stands = false;
  };
  template <class Act>
  void for_each(LinkContactRange range, const Act& act) {
    for (std::uint32_t k = range.first; k < range.end; ++k) act(chosen_[k]);
  }

  void load_other(Chosen& chosen) const {
    const SolverBody& other = state_.solver_bodies()[chosen.at.free];
    ContactBody<LinkResponse>& to = chosen.contact.other;
    to.linear = other.linear, to.angular = other.angular, to.moved = other.moved, to.turned = other.turned;
  }
  void store_other(const Chosen& chosen) {
    SolverBody& other = state_.solver_bodies()[chosen.at.free];
    other.linear = chosen.contact.other.linear, other.angular = chosen.contact.other.angular;
  }
  void list(std::uint32_t contact, std::uint32_t lane, std::span<const MechanismLink> links);
  void form_clusters();
  std::uint32_t root_of(std::uint32_t mechanism);
  bool unite(std::span<const Listed> of_body);
  bool is_to_choose(const Listed& listed, const MechanismLink& link) const;
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
  std::vector<bool> stands_;             // by mechanism
  std::vector<Cluster> clusters_;        // by mechanism; `first` leads to the smallest
  std::vector<std::uint8_t> is_chosen_;  // by manifold: a Kind
};

}  // namespace fathom::native
