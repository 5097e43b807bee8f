// Generic and distance joints as links of a mechanism: which of their coordinates are held, driven or free in a
// substep, and what they give. A link is a body and the joint to its parent. Its coordinates are of the body against
// the parent (dynamics/joint_elimination.hpp), a joint's axes those of B against A (dynamics/generic_rows-inl.hpp).
// Pure, for host and device.
#pragma once

#include <cstdint>

#include "dynamics/generic_joint.hpp"
#include "dynamics/joint_elimination.hpp"
#include "dynamics/rotation.hpp"
#include "dynamics/tuning.hpp"

namespace fathom {

/// How a body moves, in world axes.
struct LinkMotion {
  Vec3 moved, turned;    ///< m and rad, since the step began
  Vec3 linear, angular;  ///< m/s and rad/s
  bool is_isotropic = true;
  UnitQuat<float> rotation{1, {}};  ///< by `turned`
  UnitQuat<float> ahead{1, {}};     ///< and when the substep will be over: by `turned_ahead`

  /// Rad since the step began, when a substep of length h (s) will be over: rotation vectors of isotropic bodies are
  /// summed up, of others they are what they are (`turned_so_far`).
  FATHOM_HD Vec3 turned_ahead(float h) const {
    return is_isotropic ? mul_add(turned, h, angular) : turned_further(turned, h * angular);
  }
};

/// A joint's two bodies by their part in the tree.
struct LinkPair {
  const LinkMotion &body, &parent;
};

class JointLink {
 public:
  /// As the step begins. Of `row` frames, arms, gap, pull and rates are set; `is_b`: the link's body is the joint's B.
  FATHOM_HD void begin(const GenericJoint& joint, bool is_b, const GenericJointRow<float>& row,
                       const GenericImpulse& impulse);
  /// On the body at the joint, in this substep: N·s and N·m·s.
  FATHOM_HD Vec3 force() const { return force_; }
  FATHOM_HD Vec3 torque() const { return torque_; }
  /// m, from the centres of the body and of the parent to where the joint acts.
  FATHOM_HD Vec3 arm() const { return is_b_ ? arm_b_ : reach_a_; }
  FATHOM_HD Vec3 parent_arm() const { return is_b_ ? reach_a_ : arm_b_; }
  /// All rotations are held.
  FATHOM_HD bool is_stiff() const { return (freedom_.is_free >> 3) == 0; }
  FATHOM_HD void forget();
  /// The last substep's impulses no longer count.
  FATHOM_HD void let_go();

  /// Finds where the joint is; to be called when bodies have moved.
  FATHOM_HD void look(const LinkPair& pair);
  /// `relaxes`: after positions have moved, without drives.
  FATHOM_HD void begin_solution(bool relaxes) { relaxes_ = relaxes; }
  FATHOM_HD bool asks_for_masses() const;
  /// And what it takes to move its axes, where limits or drives ask for that (`GenericAxis::response`).
  FATHOM_HD void look_at_masses(const JointBodies<SymMat3>& bodies, float h);
  /// Chooses coordinates by what is held, and what drives give by now. Returns whether that has changed what there is
  /// to eliminate.
  FATHOM_HD bool choose_coordinates(const LinkPair& pair);
  /// Of the body and all that hangs on it.
  FATHOM_HD void eliminate(const TreeInertia& body) { link_ = eliminated(body, arm(), freedom_); }
  /// What the parent feels of that.
  FATHOM_HD void add_to(TreeInertia& parent) const { add_child(parent, link_, freedom_, parent_arm()); }
  /// How easily the body turns across `axis` in what is free, with what hangs on it (1/(kg·m²)).
  FATHOM_HD float response_across(Vec3 axis) const;
  /// Errors of a round (m/s and rad/s), so that what is held comes to where it is to be within h, gaps closing at
  /// `most` (m/s or rad/s) at the fastest …
  FATHOM_HD void aim_ahead(const LinkPair& pair, float most, float h);
  /// Whether these errors are within `share`, of arms or rad, as `meets` judges.
  FATHOM_HD bool is_aimed_within(float share, float h) const;
  /// … or loses its velocity and this share of its gap.
  FATHOM_HD void aim_at_rest(const LinkPair& pair, float gap_share, float min_share, float most, float h);
  /// What the parent gets of the body's load, both about the joint. `is_aimed`: errors are taken away.
  FATHOM_HD TreeLoad hand_on(const TreeLoad& load, bool is_aimed);
  /// The body's change where its parent changes thus. `counts`: the joint gives what that takes.
  FATHOM_HD TreeChange follow(const TreeChange& parent, bool is_aimed, bool counts);

  /// Takes on or lets go limits and largest forces where the rounds' result says otherwise. True where that changes it.
  FATHOM_HD bool revise(const LinkPair& pair, float h);
  /// Whether what is held will be within `share` of where the rounds aimed at: of arms, or rad.
  FATHOM_HD bool meets(const LinkPair& pair, float share, float h);
  FATHOM_HD void take_back() { force_more_ = torque_more_ = {}, is_first_round_ = true, knows_ahead_ = false; }
  FATHOM_HD Vec3 force_more() const { return force_more_; }
  FATHOM_HD Vec3 torque_more() const { return torque_more_; }
  /// The rounds' impulses count; `ends`: the substep is over.
  FATHOM_HD void apply(const LinkPair& pair, bool ends);
  FATHOM_HD GenericImpulse impulse() const;

 private:
  static constexpr int no_axis = -1;

  FATHOM_HD float sign() const { return is_b_ ? 1.0f : -1.0f; }
  FATHOM_HD const GenericAxis<float>& axis(int i) const { return joint_->axes[i]; }
  FATHOM_HD bool is_at_limit(int i) const { return at_limit_ >> i & 1u; }
  FATHOM_HD bool is_at_most(int i) const { return at_most_ >> i & 1u; }
  FATHOM_HD bool is_driven(int i) const { return !relaxes_ && axis(i).most > 0; }
  FATHOM_HD float compliance(int i) const { return fma(axis(i).response, mass_[i], axis(i).compliance); }
  /// A drive that gives whatever its velocity takes.
  FATHOM_HD bool is_rigid_drive(int i) const { return is_driven(i) && !is_at_most(i) && !(compliance(i) > 0); }
  FATHOM_HD bool is_held(int i) const { return axis(i).locked != 0 || is_at_limit(i) || is_rigid_drive(i); }
  FATHOM_HD bool may_drive(int i) const { return axis(i).most > 0 || axis(i).armature > 0; }
  /// At which a locked axis is held, or a limit that acts or would act.
  FATHOM_HD float bound(int i) const {
    const GenericAxis<float>& a = axis(i);
    const bool is_upper = is_at_limit(i) ? at_upper_ >> i & 1u : value_[i] > a.upper;
    return is_upper ? a.upper : a.lower;
  }
  FATHOM_HD float drive_aim(int i) const;
  /// m, by which gaps are judged.
  FATHOM_HD float reach() const {
    return length(row_.arm_a) + length(row_.arm_b) + (joint_->distance != 0 ? value_[0] : 0);
  }
  /// What the armature gives of N·s or N·m·s where the axis gets the rate `to`.
  FATHOM_HD float of_armature(int i, float to) const { return axis(i).armature * (rate_[i] - to); }
  FATHOM_HD void resist(int k, const LinkPair& pair);
  FATHOM_HD void note_hit(int i);
  /// Where what is held is to be at the substep's end: at its bound, or nearer to it by what `most` (m/s or rad/s)
  /// makes of the substep. A limit lets the joint come as fast as it does; one that the joint has left may still be
  /// taken for one that acts, and is not to draw it back at once.
  FATHOM_HD float wanted_value(int i, const LinkPair& pair, float most, float h) const;
  /// What takes an axis to its bound at rest: at most to close this share of its gap.
  FATHOM_HD float closing_rate(int i, float rate, float gap_share, float min_share, float most, float h) const;
  FATHOM_HD float rate(int i, const LinkPair& pair) const;
  /// Sets `ahead_`, where the substep will leave the axes with the motions that the bodies have.
  FATHOM_HD void look_ahead(const LinkPair& pair, float h);
  FATHOM_HD void add_rotation(int i, int& count, bool is_free);
  FATHOM_HD void set_errors(const JointVector& of_axes);
  /// N·s or N·m·s on B, of the substep so far and the rounds.
  FATHOM_HD float impulse_of(int k) const;
  /// `ahead`: where the substep leaves the axis, as the rounds have judged it.
  FATHOM_HD bool revise_limit(int i, float ahead, float given, float after);
  FATHOM_HD bool revise_drive(int i, float given, float after);

  const GenericJoint* joint_ = nullptr;
  bool is_b_ = true, relaxes_ = false, is_first_round_ = true, knows_ahead_ = false, aims_ahead_ = false;
  GenericJointRow<float> row_{};
  Vec3 along_[3], about_[3];                        // of axes, now
  JointVector value_{}, ahead_{}, aim_{}, mass_{};  // aim_: of what is locked or limited, where holding it leads to
  Vec3 reach_a_, arm_b_;
  JointFreedom freedom_;
  int axis_of_[joint_coordinates] = {};  // of a coordinate, or no_axis
  JointVector scale_{};                  // the axis' rate of a coordinate's
  JointVector drive_{}, error_{};
  EliminatedLink link_{};
  JointLoad load_{};
  JointVector rate_{}, bounce_{};              // m/s or rad/s: as the last solution left it, and limits throw it back
  std::uint32_t at_limit_ = 0, at_upper_ = 0;  // by axis
  std::uint32_t at_most_ = 0, at_minus_ = 0;   // drives that give the most, forwards or backwards
  Vec3 force_, torque_, force_more_, torque_more_, force_sum_, torque_sum_;
};

FATHOM_HD void JointLink::begin(const GenericJoint& joint, bool is_b, const GenericJointRow<float>& row,
                                const GenericImpulse& impulse) {
  *this = {};
  joint_ = &joint, is_b_ = is_b, row_ = row;
  row_.distance = joint.distance, row_.cone = joint.cone;
  for (int i = 0; i < axis_count; ++i) row_.axes[i] = axis(i);
  const LinkMotion unmoved{};
  look({unmoved, unmoved});
  for (int i = 0; i < axis_count; ++i) rate_[i] = row.rate[i];
  for (int i = 0; i < axis_count; ++i) {
    const float total = sign() * (impulse.hold[i] + impulse.drive[i]);
    if (i < translations)
      force_ = mul_add(force_, total, along_[i]);
    else
      torque_ = mul_add(torque_, total, about_[i - translations]);
    if (axis(i).limited == 0 || impulse.hold[i] == 0) continue;
    at_limit_ |= 1u << i;
    if (impulse.hold[i] < 0) at_upper_ |= 1u << i;
  }
}

FATHOM_HD void JointLink::let_go() { force_ = torque_ = {}; }
FATHOM_HD void JointLink::forget() { force_ = torque_ = force_sum_ = torque_sum_ = {}, at_limit_ = at_most_ = 0; }

FATHOM_HD void JointLink::look(const LinkPair& pair) {
  const LinkMotion &a = is_b_ ? pair.parent : pair.body, &b = is_b_ ? pair.body : pair.parent;
  JointBodies<float> bodies{};
  bodies.a.moved = a.moved, bodies.b.moved = b.moved;
  const GenericJointRows<float, JointBodies<float>> rows(row_, bodies, a.rotation, b.rotation);
  for (int i = 0; i < axis_count; ++i) {
    value_[i] = rows.value[i];
    if (i < translations) along_[i] = rows.along[i], about_[i] = rows.torque_axis(i);
  }
  reach_a_ = rows.reach(), arm_b_ = rows.arm();
}

FATHOM_HD bool JointLink::asks_for_masses() const {
  bool any_does = false;
  for (int i = 0; i < axis_count; ++i) any_does = any_does || axis(i).response > 0;
  return any_does;
}

FATHOM_HD void JointLink::look_at_masses(const JointBodies<SymMat3>& both, float h) {
  JointBodies<SymMat3> bodies = both;
  const GenericJointRows<float, JointBodies<SymMat3>> rows(row_, bodies, h);
  GenericSystem<float> system{};
  for (int i = 0; i < axis_count; ++i)
    for (int j = 0; j < axis_count; ++j) system.response[i][j] = rows.response(i, j);
  for (int i = 0; i < axis_count; ++i) system.eliminate(i, axis(i).locked, 0.0f);
  for (int i = 0; i < axis_count; ++i) mass_[i] = system.response[i][i];
}

// --- coordinates -----------------------------------------------------------------------------------------------

FATHOM_HD void JointLink::add_rotation(int i, int& count, bool is_free) {
  Vec3 across = about_[i - translations];
  for (int k = 0; k < count; ++k) across -= dot(across, freedom_.about[k]) * freedom_.about[k];
  const float size = length(across);
  if (size < min_axis_across) return;
  freedom_.about[count] = (1 / size) * across;
  axis_of_[translations + count] = i;
  scale_[translations + count] = size;
  if (is_free) freedom_.is_free |= 8u << count;
  ++count;
}

FATHOM_HD Vec3 any_across(Vec3 a) { return normalize(cross(a, abs(a.x) < 0.5f ? Vec3{1, 0, 0} : Vec3{0, 1, 0})); }

FATHOM_HD float JointLink::drive_aim(int i) const {
  const GenericAxis<float>& a = axis(i);
  float off = a.target - value_[i];
  if (i == translations) off = off > pi ? off - 2 * pi : off < -pi ? off + 2 * pi : off;
  return fma(a.approach, off, a.velocity);
}

FATHOM_HD bool JointLink::choose_coordinates(const LinkPair& pair) {
  const JointFreedom last = freedom_;
  freedom_ = {};
  take_back();
  for (int k = 0; k < translations; ++k) {
    freedom_.along[k] = along_[k];
    axis_of_[k] = k, scale_[k] = 1;
    if (!is_held(k)) freedom_.is_free |= 1u << k;
  }
  if (joint_->distance != 0) {
    // Anchors that meet have no line, and nothing acts along it.
    if (length_squared(along_[0]) == 0) freedom_.along[0] = {1, 0, 0}, axis_of_[0] = no_axis, freedom_.is_free |= 1u;
    freedom_.along[1] = any_across(freedom_.along[0]);
    freedom_.along[2] = cross(freedom_.along[0], freedom_.along[1]);
    axis_of_[1] = axis_of_[2] = no_axis;
  }
  int count = 0;
  const auto add_all = [&](bool are_free, const auto& belongs) {
    for (int i = translations; i < axis_count; ++i)
      if (belongs(i)) add_rotation(i, count, are_free);
  };
  add_all(false, [this](int i) { return is_held(i); });
  add_all(true, [this](int i) { return !is_held(i) && may_drive(i); });
  for (; count < translations; ++count) {
    freedom_.about[count] = count == 0   ? Vec3{1, 0, 0}
                            : count == 1 ? any_across(freedom_.about[0])
                                         : cross(freedom_.about[0], freedom_.about[1]);
    axis_of_[translations + count] = no_axis;
    freedom_.is_free |= 8u << count;
  }
  JointVector before;
  to_coordinates(freedom_, force_, torque_, before);
  for (int k = 0; k < joint_coordinates; ++k) {
    drive_[k] = error_[k] = 0;
    if (!freedom_.has(k)) continue;
    // What is free gets nothing, so it gives back what it had before it was.
    if (!relaxes_) drive_[k] = -before[k];
    if (joint_->reacts != 0) resist(k, pair);
    if (relaxes_) continue;
    const int i = axis_of_[k];
    if (i == no_axis || !is_driven(i)) continue;
    if (is_at_most(i)) {
      drive_[k] += sign() * scale_[k] * (at_minus_ >> i & 1u ? -axis(i).most : axis(i).most);
    } else {
      const float stiffness = 1 / compliance(i);
      freedom_.stiffness[k] += scale_[k] * scale_[k] * stiffness;
      drive_[k] += sign() * scale_[k] * stiffness * (drive_aim(i) - rate(i, pair));
    }
  }
  return !(freedom_ == last);
}

/// A free coordinate's armature keeps it at the rate that it had.
FATHOM_HD void JointLink::resist(int k, const LinkPair& pair) {
  const int i = axis_of_[k];
  if (i == no_axis) return;
  freedom_.stiffness[k] += scale_[k] * scale_[k] * axis(i).armature;
  drive_[k] += sign() * scale_[k] * of_armature(i, rate(i, pair));
}

FATHOM_HD float JointLink::response_across(Vec3 axis) const {
  float sum = 0;
  for (int k = 0; k < 3; ++k) {
    const float along = dot(freedom_.about[k], axis);
    sum = fma(link_.inverse[translations + k], fma(-along, along, 1.0f), sum);
  }
  return sum;
}

// --- rounds ----------------------------------------------------------------------------------------------------

FATHOM_HD float JointLink::rate(int i, const LinkPair& pair) const {
  const LinkMotion &a = is_b_ ? pair.parent : pair.body, &b = is_b_ ? pair.body : pair.parent;
  if (i >= translations) return dot(about_[i - translations], b.angular - a.angular);
  return dot(along_[i], (b.linear + cross(b.angular, arm_b_)) - (a.linear + cross(a.angular, reach_a_)));
}

FATHOM_HD void JointLink::look_ahead(const LinkPair& pair, float h) {
  if (knows_ahead_) return;
  knows_ahead_ = true;
  const LinkMotion &a = is_b_ ? pair.parent : pair.body, &b = is_b_ ? pair.body : pair.parent;
  JointBodies<float> bodies{};
  bodies.a.moved = mul_add(a.moved, h, a.linear), bodies.b.moved = mul_add(b.moved, h, b.linear);
  const GenericJointRows<float, JointBodies<float>> rows(row_, bodies, a.ahead, b.ahead);
  for (int i = 0; i < axis_count; ++i) {
    ahead_[i] = rows.value[i];
    if (i < translations) ahead_[i] = fma(-0.5f * h * h, dot(rows.along[i], row_.pull), ahead_[i]);
  }
}

FATHOM_HD float JointLink::wanted_value(int i, const LinkPair& pair, float most, float h) const {
  const float off = bound(i) - value_[i];
  if (axis(i).limited != 0) most = max(most, off > 0 ? rate(i, pair) : -rate(i, pair));
  return value_[i] + clamp(off, -most * h, most * h);
}

FATHOM_HD float JointLink::closing_rate(int i, float rate, float gap_share, float min_share, float most,
                                        float h) const {
  const float least = (min_share / h) * (i < translations ? reach() : 1.0f), pull = min(most, abs(rate) + least);
  return clamp(gap_share / h * (value_[i] - bound(i)), -pull, pull);
}

/// Of axes that are held, in the coordinates' order.
FATHOM_HD void JointLink::set_errors(const JointVector& of_axes) {
  for (int k = 0; k < joint_coordinates; ++k) {
    if (freedom_.has(k)) continue;
    float error = sign() * of_axes[axis_of_[k]];
    for (int m = translations; m < k; ++m)
      error = fma(-dot(about_[axis_of_[k] - translations], freedom_.about[m - translations]), error_[m], error);
    error_[k] = error / scale_[k];
  }
}

FATHOM_HD void JointLink::aim_ahead(const LinkPair& pair, float most, float h) {
  JointVector errors{};
  look_ahead(pair, h);
  aims_ahead_ = true;
  for (int i = 0; i < axis_count; ++i) {
    if (is_first_round_ && (axis(i).locked != 0 || axis(i).limited != 0)) aim_[i] = wanted_value(i, pair, most, h);
    errors[i] = axis(i).locked == 0 && !is_at_limit(i) ? rate(i, pair) - drive_aim(i) : (ahead_[i] - aim_[i]) / h;
  }
  set_errors(errors);
}

FATHOM_HD bool JointLink::is_aimed_within(float share, float h) const {
  for (int k = 0; k < joint_coordinates; ++k)
    if (!freedom_.has(k) && !(h * abs(error_[k]) <= (k < translations ? share * reach() : share))) return false;
  return true;
}

FATHOM_HD void JointLink::aim_at_rest(const LinkPair& pair, float gap_share, float min_share, float most, float h) {
  JointVector errors{};
  aims_ahead_ = false;
  for (int i = 0; i < axis_count; ++i) {
    errors[i] = rate(i, pair);
    if (relaxes_ && is_at_limit(i)) errors[i] -= bounce_[i];
    const float closing = gap_share > 0 ? closing_rate(i, errors[i], gap_share, min_share, most, h) : 0;
    aim_[i] = fma(-h, closing, value_[i]);
    if (axis(i).locked == 0 && !is_at_limit(i)) {
      errors[i] -= drive_aim(i);
    } else if (gap_share > 0) {
      errors[i] += closing;
      if (i < translations) errors[i] = fma(-0.5f * h, dot(along_[i], row_.pull), errors[i]);
    }
  }
  set_errors(errors);
}

FATHOM_HD TreeLoad JointLink::hand_on(const TreeLoad& load, bool is_aimed) {
  const JointVector nothing{}, &drive = drive_, &error = error_;
  // Drives give theirs in the first round.
  const bool drives = is_aimed && is_first_round_;
  load_ = eliminated_load(link_, freedom_, load, drives ? drive : nothing);
  if (is_aimed) is_first_round_ = false;
  return handed_on(link_, freedom_, load_, is_aimed ? error : nothing);
}

FATHOM_HD TreeChange JointLink::follow(const TreeChange& parent, bool is_aimed, bool counts) {
  const JointVector nothing{}, &error = error_;
  JointVector of_parent, change, impulse;
  knows_ahead_ = false;
  to_coordinates(freedom_, parent.linear + cross(parent.angular, parent_arm()), parent.angular, of_parent);
  fathom::follow(link_, freedom_, load_, is_aimed ? error : nothing, of_parent, change, impulse);
  if (counts) {
    force_more_ += linear_of(freedom_, impulse);
    torque_more_ += angular_of(freedom_, impulse);
  }
  const Vec3 angular = angular_of(freedom_, change);
  return {linear_of(freedom_, change) + cross(arm(), angular), angular};
}

// --- what rounds have found ------------------------------------------------------------------------------------

FATHOM_HD float JointLink::impulse_of(int k) const {
  const float total = k < translations ? dot(freedom_.along[k], force_ + force_more_)
                                       : dot(freedom_.about[k - translations], torque_ + torque_more_);
  return sign() * total / scale_[k];
}

FATHOM_HD bool JointLink::revise_limit(int i, float ahead, float given, float after) {
  const GenericAxis<float>& a = axis(i);
  const std::uint32_t bit = 1u << i;
  if (!is_at_limit(i)) {
    // One that comes back from beyond its limit by itself, as fast as that would take it, is let.
    if (ahead >= min(a.lower, aim_[i]) && ahead <= max(a.upper, aim_[i])) return false;
    at_limit_ |= bit, at_most_ &= ~bit;
    at_upper_ = ahead > a.upper ? at_upper_ | bit : at_upper_ & ~bit;
    note_hit(i);
    return true;
  }
  float drive = 0;
  if (is_driven(i)) {
    const float push = drive_aim(i) - after;
    drive = compliance(i) > 0 ? min(max(push / compliance(i), -a.most), a.most) : push < 0 ? -a.most : a.most;
  }
  const float held = given - drive - of_armature(i, after);
  if (at_upper_ & bit ? held <= 0 : held >= 0) return false;
  at_limit_ &= ~bit;
  bounce_[i] = 0;
  if (is_driven(i) && abs(drive) == a.most) {
    at_most_ |= bit;
    at_minus_ = drive < 0 ? at_minus_ | bit : at_minus_ & ~bit;
  }
  return true;
}

FATHOM_HD void JointLink::note_hit(int i) {
  const float speed = at_upper_ >> i & 1u ? rate_[i] : -rate_[i];
  bounce_[i] = speed > joint_->min_hit ? -axis(i).restitution * rate_[i] : 0.0f;
}

FATHOM_HD bool JointLink::revise_drive(int i, float given, float after) {
  const float most = axis(i).most;
  const std::uint32_t bit = 1u << i;
  if (!is_at_most(i)) {
    if (abs(given) <= (1 + drive_slack) * most) return false;
    at_most_ |= bit;
    at_minus_ = given < 0 ? at_minus_ | bit : at_minus_ & ~bit;
    return true;
  }
  const float short_by = at_minus_ & bit ? after - drive_aim(i) : drive_aim(i) - after;
  if (short_by >= (1 - drive_slack) * most * compliance(i)) return false;
  at_most_ &= ~bit;
  return true;
}

FATHOM_HD bool JointLink::revise(const LinkPair& pair, float h) {
  if (joint_->moves == 0) return false;
  if (aims_ahead_) look_ahead(pair, h);
  const auto ahead = [&](int i) { return aims_ahead_ ? ahead_[i] : fma(h, rate(i, pair), value_[i]); };
  const std::uint32_t were_at_limit = at_limit_;
  bool changes = false;
  for (int k = 0; k < joint_coordinates; ++k) {
    const int i = axis_of_[k];
    if (i == no_axis) continue;
    if (axis(i).limited != 0 && revise_limit(i, ahead(i), impulse_of(k), rate(i, pair)))
      changes = true;
    else if (is_driven(i) && !is_at_limit(i) && axis(i).locked == 0 &&
             revise_drive(i, impulse_of(k) - of_armature(i, rate(i, pair)), rate(i, pair)))
      changes = true;
  }
  // Axes without a coordinate are those that nothing held.
  for (int i = translations; i < axis_count; ++i)
    if (axis(i).limited != 0 && !(were_at_limit >> i & 1u) && !may_drive(i) && revise_limit(i, ahead(i), 0, 0))
      changes = true;
  return changes;
}

FATHOM_HD bool JointLink::meets(const LinkPair& pair, float share, float h) {
  look_ahead(pair, h);
  for (int i = 0; i < axis_count; ++i)
    if ((axis(i).locked != 0 || is_at_limit(i)) &&
        !(abs(ahead_[i] - aim_[i]) <= (i < translations ? share * reach() : share)))
      return false;
  return true;
}

FATHOM_HD void JointLink::apply(const LinkPair& pair, bool ends) {
  force_ += force_more_, torque_ += torque_more_;
  for (int i = 0; joint_->reacts != 0 && i < axis_count; ++i) rate_[i] = rate(i, pair);
  if (!ends) return;
  force_sum_ += force_, torque_sum_ += torque_;
  for (float& bounce : bounce_) bounce = 0;
}

FATHOM_HD GenericImpulse JointLink::impulse() const {
  GenericImpulse impulse;
  for (int k = 0; k < joint_coordinates; ++k) {
    const int i = axis_of_[k];
    if (i == no_axis) continue;
    const float total =
        sign() * (k < translations ? dot(freedom_.along[k], force_) : dot(freedom_.about[k - translations], torque_)) /
        scale_[k];
    const bool gives = may_drive(i);
    (gives && !is_at_limit(i) ? impulse.drive[i] : impulse.hold[i]) =
        gives || axis(i).locked != 0 || is_at_limit(i) ? total : 0;
  }
  impulse.force = sign() * force_sum_, impulse.torque = sign() * torque_sum_;
  return impulse;
}

}  // namespace fathom
