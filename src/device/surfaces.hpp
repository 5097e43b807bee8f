// Meshes and height fields on the device. A surface touches a body in patches, one for each contact direction
// (terrain/surface_patch.hpp), and a pair with a surface has a contact for each: they are made with the pair, linked
// from it, and solved like any other contact. The pair's own contact never touches.
//
// A pair is collided by a team, in which every work-item has a triangle of its own (math/team.hpp).
#pragma once

#include "check/check.hpp"
#include "device/update_manifolds.hpp"
#include "dynamics/triangle_ahead.hpp"
#include "exec/bits.hpp"
#include "terrain/surface_collision.hpp"

namespace fathom::device {

static_assert(patches_per_pair == max_surface_manifolds);

/// The manifolds of all pairs with surfaces that have to collide. A pair that would begin to touch but finds no room
/// for its manifolds is left unchanged and deferred.
struct CollideSurfaces {
  static constexpr std::uint32_t group_size = 64;
  static constexpr bool runs_in_teams = true;

  ContactChanges changes;
  PatchSet* sets;         ///< one for each worker
  std::uint32_t workers;  ///< that this kernel has
  float dt;               ///< s

  FATHOM_HD void operator()(std::uint32_t worker) const {
    const std::uint32_t count = changes.counters->to_collide[surfaces];
    for (std::uint32_t k = worker; k < count; k += workers)
      collide(changes.contacts.to_collide[changes.contacts.listed(surfaces, k)], sets[worker]);
  }

 private:
  /// The pair's patches that touch, or did in the last step.
  struct Patches {
    std::uint32_t contact[patches_per_pair];
    bool touches[patches_per_pair];
    std::uint32_t material[patches_per_pair];
    SurfacePush pushes[patches_per_pair];  ///< of those that touch
    int push_count = 0;
    int push_of[patches_per_pair];  ///< index of a touching patch's push
  };

  FATHOM_HD void collide(std::uint32_t index, PatchSet& set) const {
    const auto& bodies = changes.bodies;
    const auto& contacts = changes.contacts;
    const Contact pair = contacts.contacts[index];
    const TouchingPieces pieces = pieces_of(bodies, pair);
    Patches patches;
    int count = 0;
    changes.for_each_patch(pair, [&](std::uint32_t k, const Contact& patch) {
      patches.contact[count] = k;
      patches.touches[count] = patch.touching();
      patches.material[count] = patch.patch_material();
      if (patch.touching()) {
        const ContactManifold& m = contacts.manifolds[patch.manifold];
        patches.push_of[count] = patches.push_count;
        patches.pushes[patches.push_count++] = {m.normal, load_of(m)};
      }
      ++count;
    });
    FATHOM_ASSERT(count == static_cast<int>(patches_per_pair), pair.b);
    if (patches.push_count > 0 && is_recycled(pair, pieces)) {
      if (!team::is_leader()) return;
      exec::atomic_add(changes.counters->recycled, 1u);
      for (std::uint32_t p = 0; p < patches_per_pair; ++p)
        if (patches.touches[p]) colour_if_needed(patches.contact[p]);
      return watch(index, pair);
    }
    SurfaceContact found;
    Pose b_in_a;
    float time = -1;
    find(pair, pieces, patches, set, found, b_in_a, time);
    if (team::is_leader() && put_all(index, patches, found, b_in_a, time)) watch(index, pair);
    team::sync();
  }

  /// Whether the pair has moved little since its patches were made.
  FATHOM_HD bool is_recycled(const Contact& pair, const TouchingPieces& pieces) const {
    const auto& bodies = changes.bodies;
    const BodyConstants &a = bodies.constants[pieces.a], &b = bodies.constants[pieces.b];
    const Pose b_in_a = relative(bodies.poses[pair.a], bodies.poses[pair.b]);
    const float distance = recycle_distance(a.shape(), a.radius, b.shape(), b.radius);
    bool moved = false;
    changes.for_each_patch(pair, [&](std::uint32_t, Contact& patch) {
      if (!patch.touching()) return;
      const ContactManifold& m = changes.contacts.manifolds[patch.manifold];
      moved |= patch.ahead() || !moved_little(m, b_in_a, distance) || is_to_reduce_anew(patch.axis, m);
    });
    return !moved;
  }

  /// The end pose is looked at after the step: a load may press a thin piece through within one step.
  FATHOM_HD void watch(std::uint32_t index, const Contact& pair) const {
    const std::uint32_t entry = changes.contacts.fast_at(false, exec::atomic_add(changes.counters->fast[false], 1u));
    changes.contacts.fast[entry] = {index, none};
    changes.watch(entry, pair);
  }

  /// The manifolds in which the pair touches, at the relative pose `b_in_a` of its bodies, `time` (s) after the step's
  /// beginning or, if negative, at the current poses.
  FATHOM_HD void find(const Contact& pair, const TouchingPieces& pieces, const Patches& patches, PatchSet& set,
                      SurfaceContact& found, Pose& b_in_a, float& time) const {
    const auto& bodies = changes.bodies;
    const auto [a, b] = pieces;
    const BodyConstants &of_a = bodies.constants[a], &of_b = bodies.constants[b];
    const SurfaceView& surface = bodies.surfaces[of_a.hull];
    const Geometry shape = bodies.geometry(b);
    const Mover on_a{{}, of_a.radius, bodies.poses[a], bodies.velocities[a]};
    const Mover on_b{shape, of_b.radius, bodies.poses[b], bodies.velocities[b]};
    const float half = half_thickness(of_b);
    const float near = speculative_margin(of_a.radius, of_b.radius, on_a.velocity, on_b.velocity, dt);
    const float movement = movement_of(near, of_a.radius, of_b.radius, dt);
    const Pose now = relative(on_a.pose, on_b.pose);
    // The load is assumed under the body's centre of mass.
    const Vec3 centre = of_b.is_child()
                            ? inverse_rotate(on_a.pose.rotation, bodies.poses[pair.b].position - on_b.pose.position)
                            : Vec3{};
    SurfaceAhead ahead{now};
    float margin = near;
    if (movement > max(slow_movement, slow_share * half)) {
      const float rest = min(margin_at_rest(of_a.radius, of_b.radius, dt), slow_share * half);
      ahead = look_ahead(surface, on_a, on_b, now, near, rest, half);
      margin = ahead.time >= 0 ? min(near, half) : rest;
    }
    found.count = 0;
    if (!ahead.is_clear)
      collide_surface(surface, shape, ahead.b_in_a, margin, patches.pushes, patches.push_count, set, found, centre);
    if (!team::is_leader()) return;
    leave_those_that_count(pieces, ahead.b_in_a, found);
    b_in_a = of_b.is_child() ? ahead.b_in_a * relative(bodies.child_poses[b], {}) : ahead.b_in_a;
    time = ahead.time;
  }

  /// Leaves the parts of manifolds at seams that count (seams.hpp).
  FATHOM_HD void leave_those_that_count(const TouchingPieces& pieces, const Pose& b_in_a, SurfaceContact& found) const {
    const auto seams = seams_of(changes.bodies, changes.contacts, dt);
    int left = 0;
    for (int g = 0; g < found.count; ++g) {
      const Manifold kept = seams.kept_on_surface(pieces, b_in_a, found.manifolds[g]);
      if (kept.count == 0) continue;
      found.manifolds[left] = kept;
      found.materials[left] = found.materials[g];
      found.is_reduced[left++] = found.is_reduced[g];
    }
    found.count = left;
  }

  /// The first impact with any triangle that gets deep within the step (dynamics/surface_ahead.hpp).
  FATHOM_HD SurfaceAhead look_ahead(const SurfaceView& surface, const Mover& a, const Mover& b, const Pose& b_in_a,
                                    float margin, float rest, float half) const {
    SurfaceAhead result{b_in_a};
    result.is_clear = true;
    const SurfaceSweep sweep = sweep_over(a, b, b_in_a, dt);
    float earliest = 3e38f;
    const auto meet = [&](std::uint32_t number) {
      const SurfaceTriangle t(surface.triangle(number), b_in_a.position);
      earliest = min(earliest, deep_impact(t, a, b, b_in_a, half, dt));
    };
    for_each_by_team(surface, box_of_sweep(b, b_in_a, sweep, margin, rest, half), meet,
                     [&](std::uint32_t count) { result.is_clear &= count == 0; });
    for (int bits = 1; bits < static_cast<int>(team::items); bits *= 2)
      earliest = min(earliest, team::from_item_xor(earliest, bits));
    if (earliest < 3e38f) set_ahead(result, a, b, earliest);
    return result;
  }

  /// Gives every manifold to the patch of its material whose normal was most alike, or to an unused one. Returns false
  /// if there is no room for those that begin.
  FATHOM_HD bool put_all(std::uint32_t index, const Patches& patches, const SurfaceContact& found, const Pose& b_in_a,
                         float time) const {
    const auto& contacts = changes.contacts;
    int match[patches_per_pair];  // patch of each manifold, or −1
    unsigned used = 0;            // a bit for each patch
    std::uint32_t beginning = 0;
    for (int g = 0; g < found.count; ++g) {
      match[g] = max_alike(patches, found.manifolds[g].normal, found.materials[g], used);
      if (match[g] >= 0)
        used |= 1u << match[g];
      else
        ++beginning;
    }
    Counters& counters = *changes.counters;
    const std::uint32_t first = beginning > 0 ? exec::atomic_add(counters.taken_manifolds, beginning) : 0;
    if (beginning > 0 && changes.manifold_slot(first + beginning - 1) == none) {
      exec::atomic_add(counters.lacking_manifolds, beginning);
      changes.defer(index, surfaces);
      return false;
    }
    for (std::uint32_t p = 0; p < patches_per_pair; ++p)
      if (patches.touches[p] && (used >> p & 1) == 0) changes.end(contacts.contacts[patches.contact[p]]);
    std::uint32_t next = first;
    for (int g = 0; g < found.count; ++g) {
      const bool begins = match[g] < 0;
      const int patch = begins ? static_cast<int>(exec::lowest_bit(~std::uint64_t{used})) : match[g];
      used |= 1u << patch;
      Contact c = contacts.contacts[patches.contact[patch]];
      if (begins) {
        c.manifold = changes.manifold_slot(next++);
        c.set_patch_material(found.materials[g]);
      }
      c.axis.reduced = found.is_reduced[g];
      changes.put(patches.contact[patch], c, found.manifolds[g], b_in_a, time, begins);
      if (!begins) colour_if_needed(patches.contact[patch]);
    }
    return true;
  }
  FATHOM_HD void colour_if_needed(std::uint32_t patch) const {
    if (changes.contacts.contacts[patch].colour() == overflow_colour) changes.find_colour(patch);
  }
  /// The touching patch of the material, without a manifold yet, whose last normal was nearest to this one; −1 if none
  /// was near.
  FATHOM_HD int max_alike(const Patches& patches, Vec3 normal, std::uint32_t material, unsigned used) const {
    int best = -1;
    float nearest = alike_normals;
    for (std::uint32_t p = 0; p < patches_per_pair; ++p) {
      if (!patches.touches[p] || patches.material[p] != material || (used >> p & 1) != 0) continue;
      const float cosine = dot(patches.pushes[patches.push_of[p]].normal, normal);
      if (cosine > nearest) best = static_cast<int>(p), nearest = cosine;
    }
    return best;
  }
};

}  // namespace fathom::device
