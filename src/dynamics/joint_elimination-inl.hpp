// The direct solution of a tree (dynamics/joint_tree.hpp) across joints that lock some of six coordinates, drive others
// and leave the rest free. Included like dynamics/joint_link-inl.hpp.
//
// Coordinates are those of the joint: three translations of the body's point at the joint and three rotations. A body
// and all that hangs on it resist a change a of its motion there with I a, under a load p. Its parent moves that point
// by a'. Where a coordinate is locked, a = a' - error. Free coordinates are eliminated one by one: a drive with the
// force t - s (a - a') is in series with the inertia, and the parent feels I s / (I + s); without a drive it feels
// nothing at all. This is exactly zero, so the rounding of a heavy body never becomes inertia of a light parent.

inline constexpr int joint_coordinates = 6;

/// Directions of a joint's coordinates in the world, orthonormal in each group of three, and their freedom.
struct JointFreedom {
  Vec3 along[3], about[3];
  Flag is_free[joint_coordinates] = {};
  Real stiffness[joint_coordinates] = {};  ///< s of a free coordinate: N·s per m/s, N·m·s per rad/s; 0: no drive

  FATHOM_LANE_FUNCTION Mask has(int k) const { return is_set(is_free[k]); }
  FATHOM_LANE_FUNCTION Mask is_same(const JointFreedom& other) const {
    Mask same = is_set(all_set);
    for (int i = 0; i < 3; ++i) same = both(same, both(along[i] == other.along[i], about[i] == other.about[i]));
    for (int k = 0; k < joint_coordinates; ++k)
      same = both(same, both(is_free[k] == other.is_free[k], stiffness[k] == other.stiffness[k]));
    return same;
  }
};

using JointVector = Real[joint_coordinates];

/// A body and all that hangs on it, with its free coordinates eliminated.
struct EliminatedLink {
  Vec3 arm;                                ///< m, from the body's centre to the point
  JointVector inertia[joint_coordinates];  ///< as felt by the parent
  JointVector column[joint_coordinates];   ///< of each free coordinate when it was eliminated
  JointVector inverse, own;                ///< 1 / (I + s), and I
};

FATHOM_LANE_FUNCTION void to_coordinates(const JointFreedom& f, Vec3 linear, Vec3 angular, JointVector& v) {
  for (int i = 0; i < 3; ++i) v[i] = dot(f.along[i], linear), v[3 + i] = dot(f.about[i], angular);
}
FATHOM_LANE_FUNCTION Vec3 linear_of(const JointFreedom& f, const JointVector& v) {
  return v[0] * f.along[0] + (v[1] * f.along[1] + v[2] * f.along[2]);
}
FATHOM_LANE_FUNCTION Vec3 angular_of(const JointFreedom& f, const JointVector& v) {
  return v[3] * f.about[0] + (v[4] * f.about[1] + v[5] * f.about[2]);
}

/// m times the cross-product matrix of `a`, and the latter times m.
FATHOM_LANE_FUNCTION Mat3 times_skew(const Mat3& m, Vec3 a) {
  return {a.z * m.y - a.y * m.z, a.x * m.z - a.z * m.x, a.y * m.x - a.x * m.y};
}
FATHOM_LANE_FUNCTION Mat3 skew_times(Vec3 a, const Mat3& m) { return {cross(a, m.x), cross(a, m.y), cross(a, m.z)}; }

/// Adds `part` times `row`.
FATHOM_LANE_FUNCTION void add_row(JointVector& to, Real part, const JointVector& row) {
  for (int j = 0; j < joint_coordinates; ++j) to[j] = fma(part, row[j], to[j]);
}

/// The same where `mask` holds.
FATHOM_LANE_FUNCTION void add_row(Mask mask, JointVector& to, Real part, const JointVector& row) {
  for (int j = 0; j < joint_coordinates; ++j) to[j] = select(mask, fma(part, row[j], to[j]), to[j]);
}

/// Eliminates coordinate k, where it `is_free`, from all others; the parent feels `share` of it.
FATHOM_LANE_FUNCTION void eliminate_coordinate(JointVector (&m)[joint_coordinates], int k, Mask is_free,
                                               const JointVector& column, Real inverse, Real share) {
  for (int i = 0; i < joint_coordinates; ++i) {
    if (i != k) add_row(is_free, m[i], -inverse * column[i], column);
    m[i][k] = select(is_free, share * column[i], m[i][k]);
    m[k][i] = select(is_free, share * column[i], m[k][i]);
  }
}

/// Eliminates the coordinates of a body that `f` leaves free; `arm` leads from its centre.
FATHOM_LANE_FUNCTION EliminatedLink eliminated(const TreeInertia& body, Vec3 arm, const JointFreedom& f) {
  EliminatedLink link;
  link.arm = arm;
  const Mat3 vr = times_skew(body.linear, arm), rc = skew_times(arm, body.mixed);
  const Mat3 along{f.along[0], f.along[1], f.along[2]}, about{f.about[0], f.about[1], f.about[2]};
  const Mat3 rows = transpose(along), linear = rows * (body.linear * along);
  const Mat3 mixed = rows * ((vr + body.mixed) * about);
  const Mat3 angular = transpose(about) * ((body.angular - skew_times(arm, vr) - rc - transpose(rc)) * about);
  JointVector(&m)[joint_coordinates] = link.inertia;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      m[i][j] = linear(i, j), m[3 + i][3 + j] = angular(i, j), m[i][3 + j] = m[3 + j][i] = mixed(i, j);
  for (int k = 0; k < joint_coordinates; ++k) {
    link.inverse[k] = link.own[k] = Real{};
    const Mask is_free = f.has(k);
    if (!anywhere(is_free)) continue;
    const Real own = m[k][k], s = f.stiffness[k], sum = own + s, inverse = select(sum > 0.0f, 1.0f / sum, Real{});
    link.own[k] = select(is_free, own, Real{}), link.inverse[k] = select(is_free, inverse, Real{});
    for (int j = 0; j < joint_coordinates; ++j) link.column[k][j] = m[k][j];
    eliminate_coordinate(m, k, is_free, link.column[k], inverse, s * inverse);
  }
  return link;
}

/// Attaches the child to `parent`, `arm` from the parent's centre.
FATHOM_LANE_FUNCTION void add_child(TreeInertia& parent, const EliminatedLink& child, const JointFreedom& f, Vec3 arm) {
  const Mat3 along{f.along[0], f.along[1], f.along[2]}, about{f.about[0], f.about[1], f.about[2]};
  const auto block = [&](int from_row, int from_column) {
    const auto column = [&](int j) {
      return Vec3{child.inertia[from_row][j], child.inertia[from_row + 1][j], child.inertia[from_row + 2][j]};
    };
    return Mat3{column(from_column), column(from_column + 1), column(from_column + 2)};
  };
  const Mat3 rows_about = transpose(about);
  const Mat3 linear = along * (block(0, 0) * transpose(along)), mixed = along * (block(0, 3) * rows_about);
  const Mat3 angular = about * (block(3, 3) * rows_about);
  const Mat3 ls = times_skew(linear, arm), sm = skew_times(arm, mixed);
  parent.linear = parent.linear + linear;
  parent.mixed = parent.mixed + (mixed - ls);
  parent.angular = parent.angular + (angular + sm + transpose(sm) - skew_times(arm, ls));
}

/// Loads on a body in a round of the solution, in the joint's coordinates.
struct JointLoad {
  JointVector pushed;   ///< p; after elimination, what the parent gets except for errors
  JointVector reached;  ///< p + t of each free coordinate when it was eliminated
};

/// For a load about the point, and drives that give `drive` besides their response to a change.
FATHOM_LANE_FUNCTION JointLoad eliminated_load(const EliminatedLink& link, const JointFreedom& f, const TreeLoad& load,
                                               const JointVector& drive) {
  JointLoad l{};
  to_coordinates(f, load.impulse, load.moment, l.pushed);
  for (int k = 0; k < joint_coordinates; ++k) {
    const Mask is_free = f.has(k);
    if (!anywhere(is_free)) continue;
    const Real p = l.pushed[k], reached = p + drive[k], change = reached * link.inverse[k];
    l.reached[k] = reached;
    add_row(is_free, l.pushed, -change, link.column[k]);
    l.pushed[k] = select(is_free, (f.stiffness[k] * p - link.own[k] * drive[k]) * link.inverse[k], l.pushed[k]);
  }
  return l;
}

/// The load that the parent gets at the point.
FATHOM_LANE_FUNCTION TreeLoad handed_on(const EliminatedLink& link, const JointFreedom& f, const JointLoad& load,
                                        const JointVector& error) {
  JointVector v;
  for (int i = 0; i < joint_coordinates; ++i) v[i] = load.pushed[i];
  for (int j = 0; j < joint_coordinates; ++j) add_row(v, error[j], link.inertia[j]);
  return {linear_of(f, v), angular_of(f, v)};
}

/// Change of the point's motion where the parent's changes by `parent`, and the joint's impulse on the body.
FATHOM_LANE_FUNCTION void follow_at_joint(const EliminatedLink& link, const JointFreedom& f, const JointLoad& load,
                                          const JointVector& error, const JointVector& parent, JointVector& change,
                                          JointVector& impulse) {
  for (int i = 0; i < joint_coordinates; ++i) change[i] = parent[i] - error[i], impulse[i] = -load.pushed[i];
  for (int j = 0; j < joint_coordinates; ++j) add_row(impulse, change[j], link.inertia[j]);
  for (int k = joint_coordinates; k-- > 0;) {
    const Mask is_free = f.has(k);
    if (!anywhere(is_free)) continue;
    Real sum = fma(f.stiffness[k], parent[k], load.reached[k]);
    // Coordinates that were eliminated before use the parent's change.
    for (int i = 0; i < joint_coordinates; ++i)
      if (i != k) sum = fma(-link.column[k][i], i < k ? select(f.has(i), parent[i], change[i]) : change[i], sum);
    change[k] = select(is_free, sum * link.inverse[k], change[k]);
  }
}
