// What somebody chose by measurement in the laws of src/dynamics: every such number is part of the results on all
// simulators. Each says where its measurement is. What follows from a law's derivation, or is part of a formula that is
// explained as a whole, stands with the law. How each simulator divides its work is in native/tuning.hpp and
// device/tuning.hpp, and which joints make a mechanism in world/joint_trees.hpp.
#pragma once

#include <cstdint>

namespace fathom {

// --- contacts (docs/solver.md, Stiffness and damping) ----------------------------------------------------------------

/// Of the rate of substeps, the frequency of a contact's spring at most. Stiffer springs shake pyramids apart, softer
/// ones give way under load.
inline constexpr float contact_rate = 0.15f;
/// By which springs against bodies that cannot be pushed are stiffer, as their frequency is twice as high.
inline constexpr float fixed_stiffness_ratio = 4;
/// Ratio of masses from which on a pair is uneven, and the leak of its light body's contact (`stiffen_uneven`;
/// docs/log/2026-11-22-loads.md).
inline constexpr float uneven_ratio = 8.0f, uneven_share = 0.5f;
/// Mean distance of a patch's area from its centre over that of its corners, which are the contact's points: pressure
/// is spread over the patch. For a square (√2 + ln(1 + √2)) / (3 √2) = 0.541, for a rectangle of 2 to 1 0.53, for a
/// line 0.5. A little more, because towers of narrow blocks turn on each other below 0.55 (docs/validation.md, Kapla).
inline constexpr float patch_share = 0.56f;
/// Points farther apart than the nearest one by more than this (m) are only expected to touch: friction does not act
/// there (tests/solver_test.cpp).
inline constexpr float friction_reach = 0.02f;
/// Of the `impulse` solver, the part of a penetration that a substep takes away (Catto, "Iterative Dynamics with
/// Temporal Coherence", 2005).
inline constexpr float baumgarte = 0.2f;
/// Bounce sweeps that a substep has at most: a hit passes on through one body a sweep at least (docs/solver.md, Free
/// bodies and bouncing).
inline constexpr std::uint32_t max_bounce_sweeps = 8;
/// Rounds over the points of a contact that bounce together (docs/solver.md, Free bodies and bouncing).
inline constexpr int bounce_rounds = 8;
/// Time (s) in which an overlap fades to 1/e of itself. What rises so is slowed down by overlap / time², at most 4.4
/// m/s²: in stronger gravity it stays on what it rises from (tests/overlap_test.cpp).
inline constexpr float overlap_time = 0.15f;
/// Depth of a new contact that counts as touching: m at most, and shares of the thinner shape's half, of what stays and
/// of what bounces (`first_overlap`).
inline constexpr float max_first_overlap = 0.1f, first_overlap_share = 0.1f, bouncing_overlap_share = 0.7f;
/// Depth that a contact may keep under a load: a share of the thinner body's half thickness, a millimetre at least, and
/// at most that other share (`lasting_depth`).
inline constexpr float lasting_depth_share = 0.01f, min_lasting_depth = 0.001f, max_lasting_depth_share = 0.1f;
/// m/s against each other up to which pressed bodies rest: their contact's lift grows, and what it carries is no
/// rebound (`solve_points`).
inline constexpr float pressed_speed = 0.03f;
/// Rates (1/s) at which lifts grow, under loads up to so many times the bodies' weight, and fade; lifts (m) that are
/// none (docs/log/2026-11-27-lifts.md).
inline constexpr float lift_rate = 2, light_load = 30, lift_fading = 5, lift_gone = 1e-6f;
/// m at which bodies of 10 cm and more begin to touch without pressing, and at which they part
/// (docs/log/2026-11-22-events.md).
inline constexpr float touching_distance = 0.001f, parting_distance = 0.002f;

// --- manifolds that are kept (docs/architecture.md, One step; docs/log/2026-11-23-friction-patches.md) ---------------

/// m, and share of the smaller bounding radius, by which they may have moved against each other.
inline constexpr float max_recycle_distance = 0.005f, recycle_share = 0.01f;
/// Share of a manifold's load below which a point carries nothing, and from which on one point carries all (`leans`).
inline constexpr float idle_share = 0.01f, corner_share = 0.98f;
/// Sine of half the angle (5 mrad) by which bodies may have turned against each other since a manifold was made.
inline constexpr float recycle_sine_of_half_angle = 0.0025f;
/// Steps in which the load settles on corners that were chosen again.
inline constexpr std::uint8_t steps_to_settle = 15;

// --- pairs and boxes (docs/log/2026-11-26-margins.md) ----------------------------------------------------------------

/// m, and share of a body's radius, of half the speculative margin (`half_speculative_margin`).
inline constexpr float half_margin = 0.01f, half_margin_share = 0.05f;
/// m, and share of a body's radius, that the box that a broad phase keeps is larger by on each side. Bodies set 10 cm
/// apart are no pairs.
inline constexpr float fat_margin = 0.03f, fat_margin_share = 0.1f;
/// Steps of a body's way that the box reaches ahead, and share of its radius that this is at most: every step of it
/// costs pairs that never touch.
inline constexpr float fat_steps_ahead = 8, fat_reach_share = 0.25f;

// --- surfaces and rolling (docs/solver.md, Moving surfaces, Rolling) -------------------------------------------------

/// m/s at which what lies on a moving surface goes with it, and stays awake: what is held in place trembles less.
inline constexpr float min_speed_with_surface = 1e-3f;
/// Sine of the angle by which a surface may move out of its contact's plane, so that a body may go with it.
inline constexpr float max_sine_to_surface = 1e-3f;
/// What is round and touches something rolls on forever, where its material has no rolling resistance, or creeps where
/// the ground is not quite level. Up to this many times `SleepSettings::linear_speed` its spin is damped by so much
/// (1/s), so that it comes to rest; PhysX does the like below its stabilization threshold. A ball rolls freely from a
/// slope of 0.5° on.
inline constexpr float rest_speeds = 4, rest_damping = 2;
/// Part of `SleepSettings::linear_speed` up to which a body counts as not moving.
inline constexpr float still_share = 1e-3f;

// --- fast bodies (docs/solver.md, Fast pairs) ------------------------------------------------------------------------

/// A relative movement within a step (m), of which no pair needs to be asked how fast it is for its size.
inline constexpr float slow_movement = 0.002f;
/// Share of the thinner shape's half thickness that bodies may move by against each other within a step and are slow.
inline constexpr float slow_share = 0.25f;
/// Share of the thinner shape's half thickness to which what touches may be pressed inside without being knocked back.
inline constexpr float pressed_share = 0.1f;
/// m, and share of the thinner shape's half thickness, from which on bodies are apart for certain (`skin_of`).
inline constexpr float max_skin = 0.001f, skin_share = 0.02f;
/// Angle (rad) by which a body turns within a substep at most (docs/solver.md, Rotation). Turns are exact whatever the
/// angle; those of bodies with several principal moments are done in parts, whose number is bounded (rotation.hpp).
inline constexpr float max_turn = 16;
/// Angle (rad) that one part of a torque-free step turns a body by (tests/rotation_test.cpp).
inline constexpr float torque_free_part = 0.25f;
/// And how many it has at most.
inline constexpr int max_torque_free_parts = static_cast<int>(max_turn / torque_free_part);

// --- loads and inertia (docs/solver.md, Loads and inertia; docs/log/2026-11-22-loads.md) -----------------------------

/// Load beyond which sweeps are too soft, as in `sweep_load`: three quarters of what a column buckles under, over the
/// cube root of its stiffness; and of what a thin body has no room for.
inline constexpr float buckling_load = 1.8f, thin_load = 0.04f;
/// Part of the thinner body's half thickness by which a spring gives way from which on inertia helps.
inline constexpr float inertia_compression = 0.03f;
/// Times the mass of the heaviest body about that a body is made inert at most.
inline constexpr float max_inertia = 16;
/// Factors for a body's inertia from one step to the next at most, and at least.
inline constexpr float inertia_growth = 1.15f, inertia_decay = 0.8f;
/// Speed (m/s) of its bodies against each other beyond which a contact's load is that of a hit.
inline constexpr float loaded_speed = 1;

// --- supports (docs/solver.md, Supports; docs/log/2026-11-22-supports.md) --------------------------------------------

/// 1/s of the penetration that becomes velocity in a contact that is held directly.
inline constexpr float support_push_out_rate = 20;
/// m, and share of the patch's radius (`support_slop`).
inline constexpr float max_support_slop = 1e-4f, patch_radius_slop = 0.01f;
/// m, and share of a body's arm, within which points may give impulses that do not press yet (`support_reach`).
inline constexpr float max_support_reach = 5e-4f, support_reach_share = 0.02f;
/// Rounds of leaving out points that would pull.
inline constexpr int support_rounds = 3;
/// Shares of a body's weight and of a contact's load that a point may take that carries nothing yet.
inline constexpr float weight_of_body = 0.1f, weight_of_contact = 0.02f;
/// The part of its friction that a contact gives up in a solution, to be shared out anew with the rest: contacts that
/// strain against each other, which no motion tells of, let go of it in some tens of substeps.
inline constexpr float support_renewal = 0.05f;
/// Share of the speed of a fall through a substep with which bodies are left that count as not held.
inline constexpr float unheld_share = 0.05f;

// --- joints (docs/joints.md, How a joint is solved) ------------------------------------------------------------------

/// A rigid joint is a spring too: with this part of the rate of substeps for its frequency, and this damping ratio.
///
/// One sweep leaves most of what a long chain's slow motions want, and warm starting adds up what it does. Per substep,
/// with a share k of such a motion solved by a sweep, the gap x follows D³x + a D²x + k (1 + s) Dx + k s b x = 0, where
/// a, s and b are the softness' impulse scale, mass scale and bias rate times h. That is stable for every k where
/// (h ω)² < 1 + s. A joint that gave nothing back (a = 0) would blow up from chains of five on.
inline constexpr float rigid_joint_rate = 0.22f, rigid_joint_damping = 0.6f;
/// Part of its error that a coupling closes in a substep whose bodies have no other couplings, and no joints but to
/// what cannot be pushed. Its one row knows then what it moves, so it need not be soft as rows in chains are
/// (`joint_softness`; docs/joints.md, Couplings).
inline constexpr float alone_coupling_rate = 0.5f;
/// Angle (rad) of a substep beyond which the second order says nothing of where an anchor gets to
/// (docs/log/2026-11-23-generic-joints.md).
inline constexpr float max_drift = 0.7f;
/// Angle (rad) of a substep by which the last substep's impulses may turn a body more or less than they did, because
/// the arms have turned since. Of a body that is light about its anchor's arm more would say nothing of what holds now:
/// such impulses count less, and the sweep finds them anew (docs/log/2026-11-24-joint-pairs.md).
inline constexpr float max_carry = 0.05f;
/// Speed (m/s) at which a rigid joint closes its gap at most.
inline constexpr float max_pull = 60;

// --- mechanisms (docs/joints.md, Mechanisms) -------------------------------------------------------------------------

/// Of limits and largest forces, in a substep.
inline constexpr int max_revisions = 4;
/// In which anchors come to meet at a substep's end, and the shares of the arms' lengths within which another round is
/// not worth its while, and within which they count as met.
inline constexpr int newton_rounds = 3;
inline constexpr float aimed_share = 1e-6f, meeting_share = 1e-3f;
/// (h ω)² of a body that swings under what its joints carry, beyond which a substep does not follow it.
inline constexpr float stiffest_swing = 0.2f;
/// Of a gap, and of the arms, by which gaps close in a substep where anchors do not meet.
inline constexpr float projection_share = 0.2f, closing_share = 0.01f;
/// Times the inertia of a body that touches something what moves as one with it may have. A contact's rows know its two
/// bodies' masses, not what a direct solution moves with them, and are stable up to some 25 times that: a table on
/// light legs would hop on them and sink in.
inline constexpr float max_behind_a_contact = 24;
/// Of an axis of rotation: its part across those before it, below which it is not one of its own.
inline constexpr float min_axis_across = 0.1f;
/// Share of its largest force by which a drive may exceed it.
inline constexpr float drive_slack = 1e-5f;
/// Softness of a loop's row, by what its body alone would move, and the passes that find what nothing follows. Softer
/// rows give way under load, stiffer ones gain energy in loops that fit together only just
/// (docs/log/2026-11-25-loop-closures.md).
inline constexpr float closure_softness = 1e-4f;
inline constexpr int yielding_passes = 2;
/// On the error of a loop, where a solution has no other rounds.
inline constexpr int closing_rounds = 3;
/// Loops that a mechanism is cut at: what has more is a net.
inline constexpr std::uint32_t max_closures = 8;

}  // namespace fathom
