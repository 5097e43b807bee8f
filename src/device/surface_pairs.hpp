// What the kernels for surfaces do with a pair (surfaces.hpp).
#pragma once

#include "check/check.hpp"
#include "device/update_manifolds.hpp"
#include "dynamics/triangle_ahead.hpp"
#include "exec/bits.hpp"
#include "terrain/surface_collision.hpp"

namespace fathom::device {

/// How a body moves over a surface.
struct PairMotion {
  const SurfaceView& surface;
  Mover a, b;
  Pose b_in_a;
  float dt;      ///< s
  float half;    ///< m, of b's thickness
  float near;    ///< m, from where the two may touch within the step
  float rest;    ///< m, the same as if they were at rest
  bool is_fast;  ///< it could pass through the surface within the step

  FATHOM_HD PairMotion(const auto& bodies, const TouchingPieces& pieces, float step)
      : surface(bodies.surfaces[bodies.constants[pieces.a].hull]),
        a{{}, bodies.constants[pieces.a].radius, bodies.poses[pieces.a], bodies.velocities[pieces.a]},
        b{bodies.geometry(pieces.b), bodies.constants[pieces.b].radius, bodies.poses[pieces.b],
          bodies.velocities[pieces.b]},
        b_in_a(relative(a.pose, b.pose)),
        dt(step),
        half(half_thickness(bodies.constants[pieces.b])),
        near(speculative_margin(a.radius, b.radius, a.velocity, b.velocity, dt)),
        rest(min(margin_at_rest(a.radius, b.radius, dt), slow_share * half)),
        is_fast(movement_of(near, a.radius, b.radius, dt) > max(slow_movement, slow_share * half)) {}

  /// Where triangles may be met on the way.
  FATHOM_HD Aabb box_of_way() const { return box_of_sweep(b, b_in_a, sweep_over(a, b, b_in_a, dt), near, rest, half); }
  /// Time of the first deep impact with the triangle (s); 3e38: never.
  FATHOM_HD float impact(std::uint32_t number) const {
    return deep_impact(SurfaceTriangle(surface.triangle(number), b_in_a.position), a, b, b_in_a, half, dt);
  }
  /// Where the manifolds of a fast pair are to be made. `earliest`: impact of all triangles (s).
  FATHOM_HD SurfaceAhead ahead(float earliest, bool is_clear) const {
    SurfaceAhead result{b_in_a};
    result.is_clear = is_clear;
    if (earliest < never) set_ahead(result, a, b, earliest);
    return result;
  }
  FATHOM_HD float margin(const SurfaceAhead& of_fast) const {
    return !is_fast ? near : of_fast.time >= 0 ? min(near, half) : rest;
  }

  static constexpr float never = 3e38f;
};

/// What all kernels do with pairs.
struct PairsOnSurfaces {
  ContactChanges changes;
  float dt;  ///< s

  /// The pair's patches that touch, or did in the last step.
  struct Patches {
    std::uint32_t contact[patches_per_pair];
    bool touches[patches_per_pair];
    std::uint32_t material[patches_per_pair];
    SurfacePush pushes[patches_per_pair];  ///< of those that touch
    int push_count = 0;
    int push_of[patches_per_pair];  ///< index of a touching patch's push
  };

  FATHOM_HD Patches patches_of(const Contact& pair) const {
    Patches patches;
    int count = 0;
    changes.for_each_patch(pair, [&](std::uint32_t k, const Contact& patch) {
      patches.contact[count] = k;
      patches.touches[count] = patch.touching();
      patches.material[count] = patch.patch_material();
      if (patch.touching()) {
        const ContactManifold& m = changes.contacts.manifolds[patch.manifold];
        patches.push_of[count] = patches.push_count;
        patches.pushes[patches.push_count++] = {m.normal, load_of(m)};
      }
      ++count;
    });
    FATHOM_ASSERT(count == static_cast<int>(patches_per_pair), pair.b);
    return patches;
  }

  /// The end pose is looked at after the step: a load may press a thin piece through within one step.
  FATHOM_HD void watch(std::uint32_t index, const Contact& pair) const {
    const std::uint32_t entry = changes.contacts.fast_at(false, exec::atomic_add(changes.counters->fast[false], 1u));
    changes.contacts.fast[entry] = {index, none};
    changes.watch(entry, pair);
  }
  FATHOM_HD void colour_if_needed(std::uint32_t patch) const {
    if (changes.contacts.contacts[patch].colour() == overflow_colour) changes.find_colour(patch);
  }

  /// Updates the pair to its touches at a pose `time` (s) after the step's beginning, or now if that is negative. One
  /// of those that call this with the same touches `writes`.
  template <class ForEachTouch>
  FATHOM_HD void take(std::uint32_t index, const Contact& pair, const TouchingPieces& pieces, const Patches& patches,
                      const ForEachTouch& for_each_touch, const TrianglesAround& around, const Tolerance& tolerance,
                      float time, bool writes) const {
    const auto& bodies = changes.bodies;
    const BodyConstants& b = bodies.constants[pieces.b];
    // The load is assumed under the body's centre of mass.
    const Vec3 centre = b.is_child() ? inverse_rotate(bodies.poses[pieces.a].rotation,
                                                      bodies.poses[pair.b].position - bodies.poses[pieces.b].position)
                                     : Vec3{};
    SurfaceContact found;
    JoinOfTouches join(around, tolerance, is_round(b.shape()), patches.pushes, patches.push_count, centre, found);
    do {
      for_each_touch([&](const SurfaceTouch& touch) { join.take(touch); });
    } while (join.next());
    if (!writes) return;
    leave_those_that_count(pieces, around.pose, found);
    const Pose of_body = b.is_child() ? around.pose * relative(bodies.child_poses[pieces.b], {}) : around.pose;
    if (put_all(index, patches, found, of_body, time)) watch(index, pair);
  }

 private:
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
