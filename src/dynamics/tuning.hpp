// Constants chosen by measurement in the laws of src/dynamics; all simulators' results depend on every one of them.
// Each names its measurement. Constants that follow from a law's derivation, or belong to a formula that is explained
// as a whole, stand with the law. How each simulator divides its work is in native/tuning.hpp and device/tuning.hpp,
// and which joints form a mechanism in world/joint_trees.hpp.
#pragma once

#include <cstdint>

namespace fathom {

// --- contacts (docs/solver.md, Stiffness and damping) ----------------------------------------------------------------

/// Maximum frequency of a contact's spring, as a fraction of the substep rate. Stiffer springs shake pyramids apart,
/// softer ones yield under load.
inline constexpr float contact_rate = 0.15f;
/// Factor on the stiffness of springs against bodies that cannot be pushed: twice the frequency.
inline constexpr float fixed_stiffness_ratio = 4;
/// Load of a contact with jointed bodies, in weights of its own bodies, from which on it begins to count as one that
/// moves more than it knows; from twice that on it does so wholly (`jointed_part`).
inline constexpr float jointed_load = 2;
/// Mass ratio above which a pair is uneven, and the factor on the leak of its light body's contact (`stiffen_uneven`;
/// docs/log/2026-11-22-loads.md).
inline constexpr float uneven_ratio = 8.0f, uneven_share = 0.5f;
/// Mean distance of a patch's area from its centre, relative to that of its corners (the contact's points), because
/// pressure is spread over the patch. For a square (√2 + ln(1 + √2)) / (3 √2) = 0.541, for a rectangle of 2 to 1 0.53,
/// for a line 0.5. Slightly larger here: below 0.55, towers of narrow blocks turn on each other (docs/validation.md,
/// Kapla).
inline constexpr float patch_share = 0.56f;
/// Share of its limit from which a patch's friction counts as sliding. With 0.8 two more of 300 loops of light bodies
/// gain energy on the device.
inline constexpr float slides_at = 0.98f;
/// Share of a round contact's lever by which a body's centre must be off it to hang on it (`move_arms_midway`).
inline constexpr float min_hang = 0.01f;
/// Points whose separation exceeds the nearest one's by more than this (m) are only expected to touch: friction does
/// not act there (tests/solver_test.cpp).
inline constexpr float friction_reach = 0.02f;
/// Fraction of a penetration that a substep of the `impulse` solver removes (Catto, "Iterative Dynamics with Temporal
/// Coherence", 2005).
inline constexpr float baumgarte = 0.2f;
/// Maximum number of bounce sweeps per substep on the device and of cells: a hit passes through at least one body per
/// sweep (docs/solver.md, Free bodies and bouncing).
inline constexpr std::uint32_t max_bounce_sweeps = 8;
/// Rounds over the points of a contact that bounce together (docs/solver.md, Free bodies and bouncing).
inline constexpr int bounce_rounds = 8;
/// Speed (m/s) of bodies that meet or part from which the points of their contact begin with equal shares
/// (`share_impact`).
inline constexpr float landing_speed = 0.05f;
/// Time constant (s) with which an overlap fades. Bodies that rise with it are decelerated by overlap / time², at most
/// 4.4 m/s²: in stronger gravity they stay on what they rise from (tests/overlap_test.cpp).
inline constexpr float overlap_time = 0.15f;
/// Maximum depth of a new contact all of which counts as touching: in m, and as shares of the thinner shape's half
/// thickness, without and with restitution (`first_overlap`).
inline constexpr float max_first_overlap = 0.1f, first_overlap_share = 0.1f, bouncing_overlap_share = 0.7f;
/// Share of a greater depth that counts nevertheless, up to so many m.
inline constexpr float deep_overlap_share = 0.9f, max_deep_overlap = 0.5f;
/// Depth that a contact may keep under a load: a share of the thinner body's half thickness, but at least a millimetre
/// and at most the larger share (`lasting_depth`).
inline constexpr float lasting_depth_share = 0.01f, min_lasting_depth = 0.001f, max_lasting_depth_share = 0.1f;
/// Relative speed (m/s) up to which pressed bodies count as resting: their contact's lift grows, and its impulse counts
/// as a load, not a rebound (`solve_points`).
inline constexpr float pressed_speed = 0.03f;
/// Rates (1/s) at which lifts grow, under loads up to `light_load` times the bodies' weight, and fade; lifts up to
/// `lift_gone` (m) are dropped (docs/log/2026-11-27-lifts.md).
inline constexpr float lift_rate = 1, light_load = 30, lift_fading = 5, lift_gone = 1e-6f;
/// m at which bodies of 10 cm and more begin to touch without pressing, and at which they part
/// (docs/log/2026-11-22-events.md).
inline constexpr float touching_distance = 0.001f, parting_distance = 0.002f;

// --- manifolds that are kept (docs/architecture.md, One step; docs/log/2026-11-23-friction-patches.md) ---------------

/// m, and share of the smaller bounding radius: relative movement of the bodies up to which a manifold is kept.
inline constexpr float max_recycle_distance = 0.005f, recycle_share = 0.01f;
/// Share of a manifold's load below which a point carries nothing, and from which a single point carries everything
/// (`leans`).
inline constexpr float idle_share = 0.01f, corner_share = 0.98f;
/// Sine of half the relative angle (5 mrad) by which bodies may turn before their manifold is rebuilt.
inline constexpr float recycle_sine_of_half_angle = 0.0025f;
/// Steps that the load gets to settle on newly chosen corners.
inline constexpr std::uint8_t steps_to_settle = 15;

// --- pairs and boxes (docs/log/2026-11-26-margins.md) ----------------------------------------------------------------

/// m, and share of a body's radius, of half the speculative margin (`half_speculative_margin`).
inline constexpr float half_margin = 0.01f, half_margin_share = 0.05f;
/// m, and share of a body's radius: margin of the broad phase's box on each side. Bodies set 10 cm apart are not pairs.
inline constexpr float fat_margin = 0.03f, fat_margin_share = 0.1f;
/// Steps of movement by which the box reaches ahead, and the maximum reach as a share of the radius: each step ahead
/// costs pairs that never touch.
inline constexpr float fat_steps_ahead = 8, fat_reach_share = 0.25f;

// --- surfaces and rolling (docs/solver.md, Moving surfaces, Rolling) -------------------------------------------------

/// Speed (m/s) at which a body on a moving surface is carried along, and stays awake: a body held in place trembles
/// less.
inline constexpr float min_speed_with_surface = 1e-3f;
/// Sine of the angle by which a surface may move out of its contact's plane and still carry a body along.
inline constexpr float max_sine_to_surface = 1e-3f;
/// Without rolling resistance, a round body in contact rolls on forever, or creeps where the ground is not quite level.
/// Up to `rest_speeds` times `SleepSettings::linear_speed` its spin is therefore damped by `rest_damping` (1/s), and it
/// comes to rest; PhysX does something similar below its stabilization threshold. A ball still rolls freely on slopes
/// of 0.5° and more.
inline constexpr float rest_speeds = 4, rest_damping = 2;
/// Fraction of `SleepSettings::linear_speed` up to which a body counts as not moving.
inline constexpr float still_share = 1e-3f;

// --- fast bodies (docs/solver.md, Fast pairs) ------------------------------------------------------------------------

/// Relative movement within a step (m) that counts as slow for any pair, whatever its size.
inline constexpr float slow_movement = 0.002f;
/// Relative movement of two bodies within a step that counts as slow, as a share of the thinner shape's half thickness.
inline constexpr float slow_share = 0.25f;
/// Depth to which touching bodies may be pressed together without being knocked back, as a share of the thinner shape's
/// half thickness.
inline constexpr float pressed_share = 0.1f;
/// Share of the same from which on an obstacle lets a body no deeper (`is_pressed`).
inline constexpr float pressed_deep = 0.2f;
/// m, and share of the thinner shape's half thickness, beyond which bodies are certainly apart (`skin_of`).
inline constexpr float max_skin = 0.001f, skin_share = 0.02f;
/// Depth, as a share of the distance between the centres, by which a body that is jammed between others may get deeper
/// within a step (`HoldBack::jammed`): for rounding. More might add up.
inline constexpr float jammed_slack = 1e-6f;
/// Share of its velocity that a body keeps in a step in which it could not move at all.
inline constexpr float kept_when_stuck = 0.5f;
/// Maximum angle (rad) by which a body turns within a substep (docs/solver.md, Rotation). Rotations are exact for any
/// angle; bodies with several principal moments turn in a bounded number of parts (rotation.hpp).
inline constexpr float max_turn = 16;
/// Angle (rad) that one part of a torque-free step turns a body by (tests/rotation_test.cpp).
inline constexpr float torque_free_part = 0.25f;
/// Maximum number of parts.
inline constexpr int max_torque_free_parts = static_cast<int>(max_turn / torque_free_part);

// --- loads and inertia (docs/solver.md, Loads and inertia; docs/log/2026-11-22-loads.md) -----------------------------

/// Loads beyond which sweeps are too soft (`sweep_load`): three quarters of a column's buckling load over the cube root
/// of its stiffness, and the load for which a thin body has no room.
inline constexpr float buckling_load = 1.8f, thin_load = 0.04f;
/// Compression of a contact's spring above which inertia helps, as a share of the thinner body's half thickness.
inline constexpr float inertia_compression = 0.03f;
/// Maximum mass to which inertia raises a body, as a multiple of the heaviest body's around it.
inline constexpr float max_inertia = 16;
/// Maximum and minimum factor on a body's inertia from one step to the next; the minimum for a body that carries
/// no such load or stands on nothing, and for one that moves faster than `settled_speed` (m/s;
/// docs/log/2026-11-30-plates-at-rest.md).
inline constexpr float inertia_growth = 1.15f, inertia_decay = 0.98f;
inline constexpr float unloaded_decay = 0.65f, moving_decay = 0.5f, settled_speed = 0.1f;
/// Steps over which added inertia gives back momentum (`OwedMomentum`).
inline constexpr float owed_steps = 10;
/// m/s at which contacts push bodies with much added inertia out (`push_out_share`,
/// docs/log/2026-12-01-held-from-behind.md).
inline constexpr float loaded_push_out = 0.2f;
/// Relative speed (m/s) of its bodies above which a contact's load counts as a hit.
inline constexpr float loaded_speed = 1;

// --- supports (docs/solver.md, Supports; docs/log/2026-11-22-supports.md) --------------------------------------------

/// 1/s, velocity per penetration in a contact that is held directly.
inline constexpr float support_push_out_rate = 20;
/// m, and share of the patch radius (`support_slop`).
inline constexpr float max_support_slop = 1e-4f, patch_radius_slop = 0.01f;
/// m, and share of a body's arm, within which points that do not press yet may give impulses (`support_reach`).
inline constexpr float max_support_reach = 5e-4f, support_reach_share = 0.02f;
/// Maximum number of rounds that leave out points that would pull.
inline constexpr int support_rounds = 3;
/// Shares of a body's weight and of a contact's load that a point may take if it carries nothing yet.
inline constexpr float weight_of_body = 0.1f, weight_of_contact = 0.02f;
/// Fraction of its impulses that a contact gives up in a solution, to be redistributed with the remainder: contacts
/// that strain against each other without any motion relax within some tens of substeps.
inline constexpr float support_renewal = 0.05f;
/// Largest load that a solution may put on a body, as a share of that which alone would move the body by its arm within
/// a substep, for bodies that move and for those at rest (`max_load`): the latter over their speed relative to what a
/// fall gains in a substep (docs/log/2026-12-01-structures-that-fell.md).
inline constexpr float moving_load = 0.25f, resting_load = 0.125f;
/// J/kg. A structure above it is collapsing, and is left to the sweeps.
inline constexpr float calm_energy = 0.3f;
/// J/kg. A solution leaves no body above it that was calmer before (`calm_part`;
/// docs/log/2026-11-28-thrown-by-solutions.md).
inline constexpr float calm_body_energy = 0.1f;
/// Share of their speeds by which two bodies may differ that move as one.
inline constexpr float same_motion = 1e-5f;
/// Share of a structure's energy that a solution takes off at least, or else is not made.
inline constexpr float min_support_effect = 0.1f;
/// Bodies left with this share of the speed that a fall gains in a substep count as not held.
inline constexpr float unheld_share = 0.05f;

// --- joints (docs/joints.md, How a joint is solved) ------------------------------------------------------------------

/// Gap of a joint, as a share of the smaller body's bounding radius, from which on it counts as torn (torn_joint.hpp).
inline constexpr float torn_share = 0.03f;
/// A rigid joint is also a spring, with this fraction of the substep rate as its frequency, and this damping ratio.
///
/// One sweep leaves most of what a long chain's slow modes need, and warm starting adds up the sweeps' results. If a
/// sweep solves a share k of such a mode per substep, the gap x follows D³x + a D²x + k (1 + s) Dx + k s b x = 0, where
/// a, s and b are the softness' impulse scale, mass scale and bias rate times h. That is stable for every k where (h
/// ω)² < 1 + s. A joint that gave nothing back (a = 0) would blow up in chains of five or more.
inline constexpr float rigid_joint_rate = 0.22f, rigid_joint_damping = 0.6f;
/// A sweep over a spring that joins two dynamic bodies knows these two only. Where the spring is stiff beside their
/// effective mass, from h ω of about 1 on, neighbours that share a body make each other swing ever more (found in
/// random nets of soft balls and welds). So sweeps let it be no stiffer than a rigid joint is: with q = h ω (2 ζ + h ω)
/// for that mass, no more than this q, and this fraction of its error closed in a substep. The relax sweep takes off
/// the share q² / (q² + s) of the velocity across it, which from h ω = 0.6 on is more than half, and at 0.1, where
/// springs swing, 0.001. Either measure alone leaves nets of eight bodies that gain energy.
inline constexpr float stiffest_spring = 3.5f, closing_of_spring = 0.53f, settling_spring = 0.13f;
/// Fraction of its error that a coupling closes in a substep if its bodies have no other couplings, and no joints
/// except to bodies that cannot be pushed. Its one row then sees everything that it moves, so it need not be as soft as
/// rows in chains (`joint_softness`; docs/joints.md, Couplings).
inline constexpr float alone_coupling_rate = 0.5f;
/// Angle (rad) per substep beyond which the second-order expansion no longer predicts an anchor's position
/// (docs/log/2026-11-23-generic-joints.md).
inline constexpr float max_drift = 0.7f;
/// Angle (rad) per substep by which last substep's impulses may turn a body more or less than before, because the arms
/// have turned since. For a body that is light about its anchor's arm, larger impulses say nothing about the current
/// load: they are reduced, and the sweep finds them again (docs/log/2026-11-24-joint-pairs.md).
inline constexpr float max_carry = 0.05f;
/// Maximum speed (m/s) at which a rigid joint closes its gap.
inline constexpr float max_pull = 60;

// --- mechanisms (docs/joints.md, Mechanisms) -------------------------------------------------------------------------

/// Maximum number of revisions of limits and largest forces per substep.
inline constexpr int max_revisions = 4;
/// Maximum number of rounds that make anchors meet at a substep's end, and the shares of the arms' lengths within which
/// another round is not worthwhile, and within which anchors count as met.
inline constexpr int newton_rounds = 3;
inline constexpr float aimed_share = 1e-6f, meeting_share = 1e-3f;
/// (h ω)² of a body that swings under its joints' load, beyond which a substep does not follow it.
inline constexpr float stiffest_swing = 0.2f;
/// Shares of a gap, and of the arms, by which gaps close per substep where anchors do not meet.
inline constexpr float projection_share = 0.2f, closing_share = 0.01f;
/// Maximum inertia of everything that moves as one with a touching body, as a multiple of its own. A contact's rows see
/// its two bodies' masses, not what a direct solution moves with them, and are stable up to about 25 times that: a
/// table on light legs would hop on them and sink in.
inline constexpr float max_behind_a_contact = 24;
/// Rounds over the contacts that a mechanism solves (dynamics/link_contact.hpp).
inline constexpr int link_contact_rounds = 2;
/// Load from which it solves one with a free body, in weights of the two bodies' effective mass.
inline constexpr float gripping_load = 0.25f;
/// Load from which a mechanism that presses on a free body adds to its inertia, likewise: the body's other contacts
/// know nothing of what moves with the mechanism.
inline constexpr float pressing_load = 2;
/// Share by which the impulses of their points become even in each step.
inline constexpr float evened_share = 0.05f;
/// Load beyond which that share decreases in proportion, in weights of the two bodies' effective mass.
inline constexpr float evened_load = 10;
/// Most mechanisms that may push the same free bodies and still solve their contacts with them: one thread or team
/// solves them, one after the other.
inline constexpr std::uint32_t max_cluster = 8;
/// Component of a rotation axis across the preceding ones below which it does not count as independent.
inline constexpr float min_axis_across = 0.1f;
/// Tolerance on a drive's largest force, as a share of it.
inline constexpr float drive_slack = 1e-5f;
/// Angle (rad), or share of the arms, by which an axis may pass a limit that has let it go in the same solution before
/// the limit acts again: the first round is linear and does not predict the end exactly
/// (docs/log/2026-11-28-limits-once.md).
inline constexpr float limit_slack = 5e-4f;
/// Softness of a loop's row relative to the response of its body alone, and the number of passes that find what nothing
/// follows. Softer rows yield under load; stiffer ones gain energy in loops that barely fit together
/// (docs/log/2026-11-25-loop-closures.md).
inline constexpr float closure_softness = 1e-4f;
inline constexpr int yielding_passes = 2;
/// Rounds on the error of a loop, where a solution has no other rounds.
inline constexpr int closing_rounds = 3;
/// Maximum number of loops at which a mechanism is cut; a structure with more is a net.
inline constexpr std::uint32_t max_closures = 8;

}  // namespace fathom
