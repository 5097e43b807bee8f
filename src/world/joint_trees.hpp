// Finds the mechanisms of joints that are solved directly (dynamics/mechanism.hpp): trees, and bodies with few
// loops that collide with nothing (dynamics/loop_closure.hpp). With more loops, or loops that may be hit, sweeps solve
// the joints that close them; with many, as in a net, sweeps solve all joints. A hit on a loop gives impulses that
// nothing in it follows; applied again along arms that have turned, they add energy
// (docs/log/2026-11-25-loop-closures.md).
#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "dynamics/mechanism_link.hpp"
#include "world/growth.hpp"

namespace fathom {

/// Finds them among the joints and bodies of a `Source`, which numbers both:
///
///     bodies(), joints(): their number
///     is_candidate(j): may be solved directly;  is_soft(j): only where it closes no loop
///     a(j), b(j): bodies;  is_generic(j), is_driven(j), is_stiff(j), is_weld(j)
///     is_obstacle(i): joints cannot push it;  inverse_mass(i);  may_collide(i)
///     accepts(links): whether to solve the tree, root first, directly
class JointTrees {
 public:
  static constexpr std::uint32_t none = MechanismLink::none;
  /// Values of `direct()`: the joint is solved directly, in a mechanism with a drive, or in one without.
  static constexpr std::uint8_t driven = 1, undriven = 2;

  template <class Source>
  void find(const Source& source) {
    clear();
    if (source.joints() == 0) return;
    choose_candidates(source);
    list_joints(source);
    // Trees attached to an obstacle come first; a tree attached to two is a loop, cut at the later joint.
    for_each_candidate(source, [&](std::uint32_t joint) {
      const std::uint32_t a = source.a(joint), b = source.b(joint);
      if (source.is_obstacle(a) && !source.is_obstacle(b) && link_of_[b] == none) add_mechanism(source, b, joint);
      if (source.is_obstacle(b) && !source.is_obstacle(a) && link_of_[a] == none) add_mechanism(source, a, joint);
    });
    for (const std::uint32_t root : free_roots(source))
      if (link_of_[root] == none) add_mechanism(source, root, none);
  }
  void clear() {
    links_.clear(), mechanisms_.clear(), levels_.clear(), direct_.clear();
    generic_ = closure_floats_ = 0;
  }

  const std::vector<MechanismLink>& links() const { return links_; }
  const std::vector<Mechanism>& mechanisms() const { return mechanisms_; }
  /// The first link of each level and, after a mechanism's last level, its end and its copies.
  const std::vector<std::uint32_t>& levels() const { return levels_; }
  /// By joint: 0 if left to sweeps, else `driven` or `undriven`.
  const std::vector<std::uint8_t>& direct() const { return direct_; }
  /// Number of links with generic joints.
  std::uint32_t generic() const { return generic_; }
  /// Floats for the closures of loops.
  std::uint32_t closure_floats() const { return closure_floats_; }

  std::size_t memory_bytes() const {
    return links_.capacity() * sizeof(MechanismLink) + mechanisms_.capacity() * sizeof(Mechanism) + direct_.capacity() +
           is_candidate_.capacity() / 8 +
           (levels_.capacity() + link_of_.capacity() + copies_.capacity() + joints_first_.capacity() +
            joints_of_.capacity()) *
               sizeof(std::uint32_t);
  }

 private:
  static constexpr std::uint32_t max_links = 4096;    // for one thread to solve; more are a net or a rope
  static constexpr std::uint32_t links_a_loop = 8;    // at least, if sweeps solve the loops: shorter loops are a net
  static constexpr std::uint32_t max_closing = 1024;  // links times loops: six solutions each

  template <class Source, class Act>
  void for_each_candidate(const Source& source, const Act& act) const {
    for (std::uint32_t joint = 0; joint < source.joints(); ++joint)
      if (is_candidate_[joint]) act(joint);
  }

  /// Soft joints that close loops are left to sweeps: cut there, a mechanism of rigid joints might have too many loops
  /// to be solved directly. So only those are candidates at which what a free end
  /// hangs on can be taken off: part by part, where one soft joint is left to a part. Parts are what rigid joints
  /// connect, and all obstacles are one.
  template <class Source>
  void choose_candidates(const Source& source) {
    is_candidate_.assign(source.joints(), false);
    bool any_is_soft = false;
    for (std::uint32_t joint = 0; joint < source.joints(); ++joint) {
      if (!source.is_candidate(joint)) continue;
      is_candidate_[joint] = !source.is_soft(joint);
      any_is_soft = any_is_soft || source.is_soft(joint);
    }
    if (!any_is_soft) return;
    Parts parts(source.bodies() + 1);
    const auto part_of = [&](std::uint32_t body) {
      return parts.of(source.is_obstacle(body) ? source.bodies() : body);
    };
    for_each_candidate(source,
                       [&](std::uint32_t joint) { parts.join(part_of(source.a(joint)), part_of(source.b(joint))); });
    struct SoftJoints {
      std::uint32_t count = 0, numbers = 0;  // numbers: of all joints, by exclusive or; the last one is its number
    };
    std::vector<SoftJoints> soft(source.bodies() + 1);
    for (std::uint32_t joint = 0; joint < source.joints(); ++joint) {
      if (!source.is_candidate(joint) || !source.is_soft(joint)) continue;
      const std::uint32_t a = part_of(source.a(joint)), b = part_of(source.b(joint));
      if (a == b) continue;
      ++soft[a].count, soft[a].numbers ^= joint;
      ++soft[b].count, soft[b].numbers ^= joint;
    }
    for (std::uint32_t start = 0; start < soft.size(); ++start)
      for (std::uint32_t part = start; soft[part].count == 1;) {
        const std::uint32_t joint = soft[part].numbers, a = part_of(source.a(joint)), b = part_of(source.b(joint));
        is_candidate_[joint] = true;
        for (const std::uint32_t end : {a, b}) --soft[end].count, soft[end].numbers ^= joint;
        part = part == a ? b : a;
      }
  }

  template <class Source>
  void list_joints(const Source& source) {
    direct_.assign(source.joints(), 0);
    link_of_.assign(source.bodies(), none);
    joints_first_.assign(source.bodies() + 1, 0);
    for_each_candidate(
        source, [&](std::uint32_t joint) { ++joints_first_[source.a(joint)], ++joints_first_[source.b(joint)]; });
    std::uint32_t sum = 0;
    for (std::uint32_t& first : joints_first_) sum += std::exchange(first, sum);
    grow_to(joints_of_, sum);
    std::vector<std::uint32_t> next(joints_first_);
    for_each_candidate(source, [&](std::uint32_t joint) {
      joints_of_[next[source.a(joint)]++] = joint;
      joints_of_[next[source.b(joint)]++] = joint;
    });
  }

  // Heaviest first: rounding would lose a light root's inertia beside that of the bodies attached to it.
  template <class Source>
  std::vector<std::uint32_t> free_roots(const Source& source) const {
    std::vector<std::uint32_t> roots;
    for (std::uint32_t body = 0; body < source.bodies(); ++body)
      if (joints_first_[body] < joints_first_[body + 1] && !source.is_obstacle(body) && link_of_[body] == none)
        roots.push_back(body);
    std::ranges::stable_sort(roots, {}, [&](std::uint32_t body) { return source.inverse_mass(body); });
    return roots;
  }

  template <class Source>
  std::uint32_t add(const Source& source, std::uint32_t body, std::uint32_t joint, std::uint32_t parent) {
    const auto number = static_cast<std::uint32_t>(links_.size());
    MechanismLink link{body, joint, parent, none, none, 0, 0, 0, static_cast<std::uint32_t>(mechanisms_.size()), 0};
    if (joint != none) {
      link.is_b = source.b(joint) == body;
      if (parent == none) link.obstacle = link.is_b ? source.a(joint) : source.b(joint);
      if (source.is_generic(joint)) link.generic = generic_++;
      direct_[joint] = undriven;
    }
    links_.push_back(link);
    if (parent != none && links_[parent].children++ == 0) links_[parent].first_child = number;
    return number;
  }
  template <class Source>
  void add_copy(const Source& source, std::uint32_t original, std::uint32_t joint, std::uint32_t parent) {
    const std::uint32_t copy = add(source, links_[original].body, joint, parent);
    links_[copy].original = original;
    links_[copy].next_copy = std::exchange(links_[original].next_copy, copy);
    ++links_[original].copies;
    copies_.push_back(copy);
  }

  template <class Source>
  void add_mechanism(const Source& source, std::uint32_t root, std::uint32_t root_joint) {
    if (!grow(source, root, root_joint, true)) grow(source, root, root_joint, false);
  }
  /// Returns whether that is final. `cuts`: loops are cut at bodies, not left to sweeps.
  template <class Source>
  bool grow(const Source& source, std::uint32_t root, std::uint32_t root_joint, bool cuts) {
    const auto first = static_cast<std::uint32_t>(links_.size()), level = static_cast<std::uint32_t>(levels_.size());
    const std::uint32_t first_generic = generic_;
    copies_.clear();
    link_of_[root] = add(source, root, root_joint, none);
    std::uint32_t ends = 0;  // of joints that are not links; each such joint counts twice
    for (std::uint32_t i = first, next_level = first; i < links_.size(); ++i) {
      if (i == next_level) {
        levels_.push_back(i);
        next_level = static_cast<std::uint32_t>(links_.size());
      }
      if (!links_[i].is_copy()) ends += follow(source, i, cuts);
    }
    const auto end = static_cast<std::uint32_t>(links_.size()), count = end - first;
    weigh(source, first);
    const std::span<const MechanismLink> tree(links_.data() + first, count);
    const auto closures = static_cast<std::uint32_t>(copies_.size());
    const bool is_net = closures > max_closures || closures * count > max_closing || ends / 2 * links_a_loop > count;
    const auto may_collide = [&](const MechanismLink& link) { return source.may_collide(link.body); };
    const bool may_be_hit = closures > 0 && std::ranges::any_of(tree, may_collide);
    if (count <= max_links && !is_net && !may_be_hit && source.accepts(tree)) {
      float mass = 0;
      for (const MechanismLink& link : tree)
        if (!link.is_copy()) mass += 1 / source.inverse_mass(link.body);
      mechanisms_.push_back(
          {first, end, level, static_cast<std::uint32_t>(levels_.size()) - level, closures, closure_floats_, mass});
      levels_.push_back(end);
      levels_.insert(levels_.end(), copies_.begin(), copies_.end());
      closure_floats_ += LoopClosure::size(closures);
      note_driven(source, tree);
      return true;
    }
    for (const MechanismLink& link : tree)
      if (link.joint != none) direct_[link.joint] = 0;
    // If there is no other attempt, the bodies stay marked and are not tried again.
    const bool gives_up = copies_.empty();
    for (const MechanismLink& link : tree)
      if (!gives_up) link_of_[link.body] = none;
    links_.resize(first);
    levels_.resize(level);
    generic_ = first_generic;
    return gives_up;
  }
  /// Adds what is attached to link i. Returns how many joint ends it leaves to sweeps.
  template <class Source>
  std::uint32_t follow(const Source& source, std::uint32_t i, bool cuts) {
    std::uint32_t ends = 0;
    const std::uint32_t body = links_[i].body;
    const auto each_joint = [&](const auto& act) {
      for (std::uint32_t k = joints_first_[body]; k < joints_first_[body + 1]; ++k) {
        const std::uint32_t joint = joints_of_[k];
        if (!direct_[joint]) act(joint, source.a(joint) == body ? source.b(joint) : source.a(joint));
      }
    };
    each_joint([&](std::uint32_t joint, std::uint32_t other) {
      if (source.is_obstacle(other)) return;
      if (link_of_[other] == none)
        link_of_[other] = add(source, other, joint, i);
      else if (!cuts)
        ++ends;
      else if (link_of_[other] < i || source.inverse_mass(other) <= source.inverse_mass(body))
        add_copy(source, link_of_[other], joint, i);  // of the heavier one: otherwise the other link handles this joint
    });
    // After the link's children, which are consecutive.
    each_joint([&](std::uint32_t joint, std::uint32_t other) {
      if (!source.is_obstacle(other)) return;
      if (cuts)
        add_copy(source, i, joint, none);
      else
        ends += 2;
    });
    return ends;
  }

  /// Sums the masses connected by stiff joints, from link `first` on.
  template <class Source>
  void weigh(const Source& source, std::uint32_t first) {
    const auto is_bound = [&](const MechanismLink& link) {
      return link.parent != none && !link.is_copy() && source.is_stiff(link.joint);
    };
    for (std::uint32_t i = first; i < links_.size(); ++i)
      if (links_[i].parent != none && source.is_weld(links_[i].joint))
        links_[i].is_welded = links_[links_[i].parent].is_welded = 1;
    // Parents come first. Backwards, each link adds its sum to its parent's; forwards, each gets the total.
    for (std::uint32_t i = first; i < links_.size(); ++i)
      links_[i].rigid_mass = links_[i].is_copy() ? 0 : 1 / source.inverse_mass(links_[i].body);
    for (auto i = static_cast<std::uint32_t>(links_.size()); i-- > first;)
      if (is_bound(links_[i])) links_[links_[i].parent].rigid_mass += links_[i].rigid_mass;
    for (std::uint32_t i = first; i < links_.size(); ++i)
      if (is_bound(links_[i])) links_[i].rigid_mass = links_[links_[i].parent].rigid_mass;
  }

  template <class Source>
  void note_driven(const Source& source, std::span<const MechanismLink> tree) {
    const auto is_driven = [&](const MechanismLink& link) {
      return link.joint != none && source.is_driven(link.joint);
    };
    if (std::ranges::none_of(tree, is_driven)) return;
    for (const MechanismLink& link : tree)
      if (link.joint != none) direct_[link.joint] = driven;
  }

  /// Disjoint sets of bodies that joints connect.
  class Parts {
   public:
    explicit Parts(std::uint32_t bodies) : above_(bodies) { std::iota(above_.begin(), above_.end(), 0u); }
    std::uint32_t of(std::uint32_t body) {
      while (above_[body] != body) body = above_[body] = above_[above_[body]];
      return body;
    }
    void join(std::uint32_t a, std::uint32_t b) { above_[std::max(a, b)] = std::min(a, b); }

   private:
    std::vector<std::uint32_t> above_;
  };

  std::vector<MechanismLink> links_;
  std::vector<Mechanism> mechanisms_;
  std::vector<std::uint32_t> levels_;
  std::vector<std::uint8_t> direct_;
  std::uint32_t generic_ = 0, closure_floats_ = 0;
  std::vector<bool> is_candidate_;           // by joint
  std::vector<std::uint32_t> copies_;        // of the mechanism being grown
  std::vector<std::uint32_t> link_of_;       // by body, or none
  std::vector<std::uint32_t> joints_first_;  // by body: where its joints begin in `joints_of_`
  std::vector<std::uint32_t> joints_of_;
};

}  // namespace fathom
