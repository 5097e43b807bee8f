#include "native/joint_links.hpp"

#include "dynamics/joint_limits.hpp"

namespace fathom::native {

namespace {

constexpr float min_direction = 0.1f;  // of an axis of rotation, across those before it
constexpr float max_slack = 1e-5f;     // share of its largest force by which a drive may exceed it

}  // namespace

void JointLink::begin(const GenericJoint& joint, bool is_b, const GenericJointRow<float>& row,
                      const GenericImpulse& impulse) {
  *this = {};
  joint_ = &joint, is_b_ = is_b, row_ = row;
  look({}, 0, true);
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

void JointLink::forget() { force_ = torque_ = force_sum_ = torque_sum_ = {}, at_limit_ = at_most_ = 0; }

void JointLink::look(const JointBodies<SymMat3>& both, float h, bool relaxes) {
  relaxes_ = relaxes;
  row_.distance = joint_->distance, row_.cone = joint_->cone;
  for (int i = 0; i < axis_count; ++i) row_.axes[i] = axis(i);
  JointBodies<SymMat3> bodies = both;
  const GenericJointRows<float, JointBodies<SymMat3>> rows(row_, bodies, h);
  bool any_response = false;
  for (int i = 0; i < axis_count; ++i) {
    value_[i] = rows.value[i];
    if (i < translations) along_[i] = rows.along[i], about_[i] = rows.torque_axis(i);
    any_response = any_response || axis(i).response > 0;
  }
  reach_a_ = rows.reach(), arm_b_ = rows.arm();
  if (!any_response) return;
  GenericSystem<float> system{};
  for (int i = 0; i < axis_count; ++i)
    for (int j = 0; j < axis_count; ++j) system.response[i][j] = rows.response(i, j);
  for (int i = 0; i < axis_count; ++i) system.eliminate(i, axis(i).locked, 0.0f);
  for (int i = 0; i < axis_count; ++i) mass_[i] = system.response[i][i];
}

// --- coordinates -----------------------------------------------------------------------------------------------

void JointLink::add_rotation(int i, int& count, bool is_free) {
  Vec3 across = about_[i - translations];
  for (int k = 0; k < count; ++k) across -= dot(across, freedom_.about[k]) * freedom_.about[k];
  const float size = length(across);
  if (size < min_direction) return;
  freedom_.about[count] = (1 / size) * across;
  axis_of_[translations + count] = i;
  scale_[translations + count] = size;
  if (is_free) freedom_.is_free |= 8u << count;
  ++count;
}

static Vec3 any_across(Vec3 a) { return normalize(cross(a, abs(a.x) < 0.5f ? Vec3{1, 0, 0} : Vec3{0, 1, 0})); }

float JointLink::drive_aim(int i) const {
  const GenericAxis<float>& a = axis(i);
  float off = a.target - value_[i];
  if (i == translations) off = off > pi ? off - 2 * pi : off < -pi ? off + 2 * pi : off;
  return fma(a.approach, off, a.velocity);
}

void JointLink::choose_coordinates(const LinkPair& pair) {
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
  add_all(true, [this](int i) { return !is_held(i) && (axis(i).most > 0 || axis(i).armature > 0); });
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
}

/// A free coordinate's armature keeps it at the rate that it had.
void JointLink::resist(int k, const LinkPair& pair) {
  const int i = axis_of_[k];
  if (i == no_axis) return;
  freedom_.stiffness[k] += scale_[k] * scale_[k] * axis(i).armature;
  drive_[k] += sign() * scale_[k] * of_armature(i, rate(i, pair));
}

void JointLink::eliminate(const TreeInertia& body, TreeInertia* parent) {
  link_ = eliminated(body, arm(), freedom_);
  if (parent) add_child(*parent, link_, freedom_, parent_arm());
}

// --- rounds ----------------------------------------------------------------------------------------------------

float JointLink::rate(int i, const LinkPair& pair) const {
  const LinkMotion &a = is_b_ ? pair.parent : pair.body, &b = is_b_ ? pair.body : pair.parent;
  if (i >= translations) return dot(about_[i - translations], b.angular - a.angular);
  return dot(along_[i], (b.linear + cross(b.angular, arm_b_)) - (a.linear + cross(a.angular, reach_a_)));
}

void JointLink::values_ahead(const LinkPair& pair, float h, JointVector& values) const {
  const LinkMotion &a = is_b_ ? pair.parent : pair.body, &b = is_b_ ? pair.body : pair.parent;
  JointBodies<float> bodies{};
  bodies.a.moved = mul_add(a.moved, h, a.linear), bodies.a.turned = a.turned_ahead(h);
  bodies.b.moved = mul_add(b.moved, h, b.linear), bodies.b.turned = b.turned_ahead(h);
  const GenericJointRows<float, JointBodies<float>> rows(row_, bodies, 0);
  for (int i = 0; i < axis_count; ++i) {
    values[i] = rows.value[i];
    if (i < translations) values[i] = fma(-0.5f * h * h, dot(rows.along[i], row_.pull), values[i]);
  }
}

float JointLink::wanted_value(int i, float h) const {
  const float bound = at_upper_ >> i & 1u ? axis(i).upper : axis(i).lower, most = max_pull * h;
  return value_[i] + min(max(bound - value_[i], -most), most);
}

/// Of axes that are held, in the coordinates' order.
void JointLink::set_errors(const JointVector& of_axes) {
  for (int k = 0; k < joint_coordinates; ++k) {
    if (freedom_.has(k)) continue;
    float error = sign() * of_axes[axis_of_[k]];
    for (int m = translations; m < k; ++m)
      error = fma(-dot(about_[axis_of_[k] - translations], freedom_.about[m - translations]), error_[m], error);
    error_[k] = error / scale_[k];
  }
}

void JointLink::aim_ahead(const LinkPair& pair, float h) {
  JointVector ahead, errors{};
  values_ahead(pair, h, ahead);
  for (int i = 0; i < axis_count; ++i)
    errors[i] =
        axis(i).locked == 0 && !is_at_limit(i) ? rate(i, pair) - drive_aim(i) : (ahead[i] - wanted_value(i, h)) / h;
  set_errors(errors);
}

void JointLink::aim_at_rest(const LinkPair& pair, float gap_share, float most, float h) {
  JointVector errors{};
  for (int i = 0; i < axis_count; ++i) {
    errors[i] = rate(i, pair);
    if (relaxes_ && is_at_limit(i)) errors[i] -= bounce_[i];
    if (axis(i).locked == 0 && !is_at_limit(i)) {
      errors[i] -= drive_aim(i);
    } else if (gap_share > 0) {
      const float gap = value_[i] - (at_upper_ >> i & 1u ? axis(i).upper : axis(i).lower);
      errors[i] += min(max(gap_share / h * gap, -most), most);
      if (i < translations) errors[i] = fma(-0.5f * h, dot(along_[i], row_.pull), errors[i]);
    }
  }
  set_errors(errors);
}

TreeLoad JointLink::hand_on(const TreeLoad& load) {
  const JointVector nothing{};
  load_ = eliminated_load(link_, freedom_, load, is_first_round_ ? drive_ : nothing);
  is_first_round_ = false;
  return handed_on(link_, freedom_, load_, error_);
}

TreeChange JointLink::follow(const TreeChange& parent) {
  JointVector of_parent, change, impulse;
  to_coordinates(freedom_, parent.linear + cross(parent.angular, parent_arm()), parent.angular, of_parent);
  fathom::follow(link_, freedom_, load_, error_, of_parent, change, impulse);
  force_more_ += linear_of(freedom_, impulse);
  torque_more_ += angular_of(freedom_, impulse);
  const Vec3 angular = angular_of(freedom_, change);
  return {linear_of(freedom_, change) + cross(arm(), angular), angular};
}

// --- what rounds have found ------------------------------------------------------------------------------------

float JointLink::impulse_of(int k) const {
  const float total = k < translations ? dot(freedom_.along[k], force_ + force_more_)
                                       : dot(freedom_.about[k - translations], torque_ + torque_more_);
  return sign() * total / scale_[k];
}

bool JointLink::revise_limit(int i, float ahead, float given, float after) {
  const GenericAxis<float>& a = axis(i);
  const std::uint32_t bit = 1u << i;
  if (!is_at_limit(i)) {
    if (ahead >= a.lower && ahead <= a.upper) return false;
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
  return true;
}

void JointLink::note_hit(int i) {
  const float speed = at_upper_ >> i & 1u ? rate_[i] : -rate_[i];
  bounce_[i] = speed > joint_->min_hit ? -axis(i).restitution * rate_[i] : 0.0f;
}

bool JointLink::revise_drive(int i, float given, float after) {
  const float most = axis(i).most;
  const std::uint32_t bit = 1u << i;
  if (!is_at_most(i)) {
    if (abs(given) <= (1 + max_slack) * most) return false;
    at_most_ |= bit;
    at_minus_ = given < 0 ? at_minus_ | bit : at_minus_ & ~bit;
    return true;
  }
  const float short_by = at_minus_ & bit ? after - drive_aim(i) : drive_aim(i) - after;
  if (short_by >= (1 - max_slack) * most * compliance(i)) return false;
  at_most_ &= ~bit;
  return true;
}

bool JointLink::revise(const LinkPair& pair, float h) {
  if (joint_->moves == 0) return false;
  JointVector ahead;
  values_ahead(pair, h, ahead);
  bool changes = false;
  for (int k = 0; k < joint_coordinates; ++k) {
    const int i = axis_of_[k];
    if (i == no_axis) continue;
    if (axis(i).limited != 0 && revise_limit(i, ahead[i], impulse_of(k), rate(i, pair)))
      changes = true;
    else if (is_driven(i) && !is_at_limit(i) && axis(i).locked == 0 &&
             revise_drive(i, impulse_of(k) - of_armature(i, rate(i, pair)), rate(i, pair)))
      changes = true;
  }
  // Axes without a coordinate are those that nothing holds.
  for (int i = translations; i < axis_count; ++i)
    if (axis(i).limited != 0 && !is_at_limit(i) && !(axis(i).most > 0 || axis(i).armature > 0) &&
        revise_limit(i, ahead[i], 0, 0))
      changes = true;
  return changes;
}

bool JointLink::meets(const LinkPair& pair, float h, float share) const {
  JointVector ahead;
  values_ahead(pair, h, ahead);
  const float reach = share * (length(row_.arm_a) + length(row_.arm_b) + (joint_->distance != 0 ? value_[0] : 0));
  for (int i = 0; i < axis_count; ++i)
    if ((axis(i).locked != 0 || is_at_limit(i)) &&
        !(abs(ahead[i] - wanted_value(i, h)) <= (i < translations ? reach : share)))
      return false;
  return true;
}

void JointLink::apply(const LinkPair& pair, bool ends) {
  force_ += force_more_, torque_ += torque_more_;
  for (int i = 0; joint_->reacts != 0 && i < axis_count; ++i) rate_[i] = rate(i, pair);
  if (!ends) return;
  force_sum_ += force_, torque_sum_ += torque_;
  for (float& bounce : bounce_) bounce = 0;
}

GenericImpulse JointLink::impulse() const {
  GenericImpulse impulse;
  for (int k = 0; k < joint_coordinates; ++k) {
    const int i = axis_of_[k];
    if (i == no_axis) continue;
    const float total =
        sign() * (k < translations ? dot(freedom_.along[k], force_) : dot(freedom_.about[k - translations], torque_)) /
        scale_[k];
    const bool gives = axis(i).most > 0 || axis(i).armature > 0;
    (gives && !is_at_limit(i) ? impulse.drive[i] : impulse.hold[i]) =
        gives || axis(i).locked != 0 || is_at_limit(i) ? total : 0;
  }
  impulse.force = sign() * force_sum_, impulse.torque = sign() * torque_sum_;
  return impulse;
}

}  // namespace fathom::native
