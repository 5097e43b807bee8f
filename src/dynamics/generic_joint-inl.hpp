// How a sweep solves the rows of a generic or distance joint (dynamics/generic_rows-inl.hpp, which is included first),
// over the same lane type L.
//
// A sweep solves all axes at once. Eliminating the locked axes (Gauss-Jordan) leaves the effective masses of the
// others. Drives are solved as soft rows, then solved again with the limits that this result would break, and with
// drives that would exceed their largest force clamped to it. A substep is a RATTLE step, as for a ball joint.

/// Equations of six rows, `response` x = `wanted`, and which of them have been solved.
template <class L>
struct GenericSystem {
  L response[axis_count][axis_count];
  L wanted[axis_count];
  L pull[axis_count];  ///< the part of `wanted` that brings axes back to their limits; used only by `solve_free_axes`
  L inverse[axis_count];  ///< of the diagonal for solved rows, else 0

  /// Solves row i for its impulse where `active` is 1, and eliminates it from all others.
  template <bool pulls = false>
  FATHOM_LANE_FUNCTION void eliminate(int i, L active, L compliance) {
    const L pivot = active * inverse_or_zero(response[i][i] + compliance);
    inverse[i] = inverse[i] + pivot;
    for (int j = 0; j < axis_count; ++j) {
      if (j == i) continue;
      const L share = splat<L>(0.0f) - response[j][i] * pivot;
      wanted[j] = mul_add(wanted[j], share, wanted[i]);
      if constexpr (pulls) pull[j] = mul_add(pull[j], share, pull[i]);
      for (int k = 0; k < axis_count; ++k)
        if (k != i) response[j][k] = mul_add(response[j][k], share, response[i][k]);
      response[j][i] = choose(active, splat<L>(0.0f), response[j][i]);
    }
  }
  /// Applies the known impulse `impulse` on row i.
  FATHOM_LANE_FUNCTION void give(int i, L impulse) {
    for (int j = 0; j < axis_count; ++j) wanted[j] = mul_add(wanted[j], splat<L>(0.0f) - impulse, response[j][i]);
  }
};

/// How a sweep treats an axis that is not locked.
template <class L>
struct FreeAxis {
  L is_driven, is_at_limit;  ///< 1 or 0: solved as a soft row; as a rigid row
  L compliance, aim;         ///< of the drive: wanted velocity is aim - compliance · impulse
  L bound;                   ///< speed (m/s or rad/s) at which it reaches its limit
  L pull;                    ///< the part of `bound` that brings it back from beyond the limit
  L given;                   ///< N·s, known impulse
};

// Armature I takes the impulse I (v - v') from whatever changes the rate of its axis from v to v': it acts as a drive
// that holds the old rate with compliance 1 / I. In parallel with a drive that wants aim - compliance · impulse, the
// two form one drive that wants
//   (aim + compliance I v) / (1 + compliance I) - compliance / (1 + compliance I) · impulse
// until the drive reaches its largest force.

/// Combines a drive with an armature, or adds the armature alone.
template <class L>
FATHOM_LANE_FUNCTION void add_armature(FreeAxis<L>& f, L armature, L rate) {
  const L zero = splat<L>(0.0f), one = splat<L>(1.0f), least = splat<L>(1e-30f);
  const L product = f.compliance * armature, sum = one + product, has = is_less(zero, armature);
  const L aim = mul_add(f.aim, product, rate) / sum, compliance = f.compliance / sum;
  f.aim = choose(has, choose(f.is_driven, aim, rate), f.aim);
  f.compliance = choose(has, choose(f.is_driven, compliance, one / larger(armature, least)), f.compliance);
  f.is_driven = larger(f.is_driven, has);
}

/// The same with a drive at its largest impulse `most`, or at its reverse.
template <class L>
FATHOM_LANE_FUNCTION void add_limit_to_armature(FreeAxis<L>& f, L armature, L rate, L most) {
  const L compliance = splat<L>(1.0f) / larger(armature, splat<L>(1e-30f));
  f.aim = mul_add(rate, compliance, most);
  f.compliance = compliance;
}

/// Solves the unlocked axes of a system whose locked ones have been eliminated.
template <class L>
FATHOM_LANE_FUNCTION void solve_free_axes(GenericSystem<L>& system, const GenericJointRow<L>& row,
                                          const FreeAxis<L> (&axes)[axis_count]) {
  for (int i = 0; i < axis_count; ++i) system.give(i, axes[i].given);
  for (int i = 0; i < axis_count; ++i) {
    const FreeAxis<L>& axis = axes[i];
    const L compliance = choose(axis.is_driven, axis.compliance, splat<L>(0.0f));
    const L aim = axis.aim - axis.compliance * row.drive[i];
    const L more = choose(axis.is_driven, aim, choose(axis.is_at_limit, axis.bound, splat<L>(0.0f)));
    system.wanted[i] = system.wanted[i] + more;
    system.pull[i] = system.pull[i] + axis.pull;
    system.template eliminate<true>(i, larger(axis.is_driven, axis.is_at_limit), compliance);
  }
}

/// Locked axes are soft: they let part of the load through and give back part of their impulses. The other axes
/// therefore get that part of the eliminated system and the rest of the original one.
template <class L>
FATHOM_LANE_FUNCTION void soften(GenericSystem<L>& system, const GenericSystem<L>& before,
                                 const GenericJointRow<L>& row) {
  const L one = splat<L>(1.0f);
  for (int i = 0; i < axis_count; ++i) {
    const L is_free = one - row.axes[i].locked, part = is_free * row.impulse_scale;
    L wanted = before.wanted[i];
    for (int j = 0; j < axis_count; ++j) {
      wanted = mul_add(wanted, row.axes[j].locked * row.hold[j], before.response[i][j]);
      const L share = part * (one - row.axes[j].locked);
      system.response[i][j] = mul_add(system.response[i][j], share, before.response[i][j] - system.response[i][j]);
    }
    system.wanted[i] = mul_add(system.wanted[i], part, wanted - system.wanted[i]);
  }
}

/// Whether a drive that is not at a limit exceeds its largest impulse with `wanted`, which leaves the axis the rate
/// `speed`. A drive with an armature is replaced by one at its largest impulse instead.
template <class L>
FATHOM_LANE_FUNCTION L exceeds_beside_armature(FreeAxis<L>& f, const GenericAxis<L>& a, L rate, L wanted, L speed) {
  const L zero = splat<L>(0.0f), one = splat<L>(1.0f), has = is_less(zero, a.armature);
  const L of_drive = wanted - a.armature * (rate - speed);
  const L exceeds = is_less(a.most, larger(of_drive, zero - of_drive)) * (one - f.is_at_limit);
  FreeAxis<L> at_most = f;
  add_limit_to_armature(at_most, a.armature, rate, bounded(of_drive, a.most));
  f.aim = choose(exceeds * has, at_most.aim, f.aim);
  f.compliance = choose(exceeds * has, at_most.compliance, f.compliance);
  return exceeds * (one - has);
}

/// The rate at which an axis bounces off a limit; `side` is -1 for the lower limit, 1 for the upper one, or 0. The
/// approach speed is its last rate: the bodies' velocities already contain the repeated impulses of the last substep.
template <class L>
FATHOM_LANE_FUNCTION L bounce_of(const GenericJointRow<L>& row, int i, L side) {
  const L is_hit = is_less(row.min_hit, side * row.rate[i]);
  return splat<L>(0.0f) - is_hit * row.axes[i].restitution * row.rate[i];
}

/// 1 where sweeps have to tame an axis, a spring in place of a lock (see `stiffest_spring`).
template <class L, class Bodies>
FATHOM_LANE_FUNCTION L is_tamed(const GenericJointRow<L>& row, const Bodies& bodies, int i) {
  const L zero = splat<L>(0.0f), one = splat<L>(1.0f);
  const GenericAxis<L>& a = row.axes[i];
  const L is_spring = is_less(zero, a.compliance) * (one - a.limited);
  return pushes_both<L>(bodies) * (row.is_soft * is_spring * (one - is_less(zero, a.armature)));
}

/// Solves limits and drives of a system after the locked axes, in two rounds: one without limits and largest forces,
/// and one with those that the first result exceeds.
template <class L, class Rows>
FATHOM_LANE_FUNCTION void drive_and_limit(GenericSystem<L>& system, const GenericSystem<L>& before,
                                          GenericJointRow<L>& row, const Rows& rows, L h, bool reacts,
                                          L (&hold)[axis_count], L (&drive)[axis_count], L (&pull)[axis_count]) {
  soften(system, before, row);
  const L zero = splat<L>(0.0f), one = splat<L>(1.0f), turn = splat<L>(3.14159265f);
  FreeAxis<L> axes[axis_count];
  for (int i = 0; i < axis_count; ++i) {
    const GenericAxis<L>& a = row.axes[i];
    FreeAxis<L>& f = axes[i];
    L off = a.target - rows.value[i];
    if (i == translations) {  // the short way round
      off = choose(is_less(turn, off), off - (turn + turn), off);
      off = choose(is_less(off, zero - turn), off + (turn + turn), off);
    }
    f.is_driven = is_less(zero, a.most);
    const L tame = is_tamed(row, rows.bodies, i);
    f.compliance =
        choose(tame, larger(a.compliance, splat<L>(1 / stiffest_spring) * before.response[i][i]), a.compliance);
    f.aim = mul_add(a.velocity, choose(tame, smaller(a.approach, splat<L>(closing_of_spring) / h), a.approach), off);
    f.is_at_limit = f.bound = f.pull = zero;
    f.given = zero - a.limited * row.hold[i];
    if (reacts) add_armature(f, a.armature, row.rate[i]);
  }
  GenericSystem<L> first = system;
  solve_free_axes(first, row, axes);
  for (int i = 0; i < axis_count; ++i) {
    const GenericAxis<L>& a = row.axes[i];
    FreeAxis<L>& f = axes[i];
    const L wanted = row.drive[i] + first.wanted[i] * first.inverse[i];
    const L speed = choose(f.is_driven, f.aim - f.compliance * wanted, zero - first.wanted[i]);
    const L at = mul_add(rows.value[i], h, speed + rows.drift[i]);
    const L below = is_less(at, a.lower), above = is_less(a.upper, at);
    const L most = splat<L>(max_pull);
    f.is_at_limit = a.limited * larger(below, above);
    const L to_bound = bounded((choose(below, a.lower, a.upper) - rows.value[i]) / h, most);
    f.bound = to_bound - rows.drift[i];
    f.pull = f.is_at_limit * choose(below, larger(to_bound, zero), smaller(to_bound, zero));
    L exceeds = is_less(a.most, larger(wanted, zero - wanted)) * (one - f.is_at_limit);
    const L bounded_drive = bounded(wanted, a.most);
    L at_bound = (f.aim - f.bound) / larger(f.compliance, splat<L>(1e-12f) * system.response[i][i]);
    if (reacts) {
      const L of_armature = a.armature * (row.rate[i] - f.bound);
      at_bound = bounded(at_bound - of_armature, a.most) + of_armature;
      exceeds = exceeds_beside_armature(f, a, row.rate[i], wanted, speed);
      row.bounce[i] = bounce_of(row, i, choose(below, splat<L>(-1.0f), f.is_at_limit));
    } else {
      at_bound = bounded(at_bound, a.most);
    }
    // At a limit the axis' velocity is known, and hence the drive's impulse.
    const L known = choose(f.is_at_limit, at_bound, bounded_drive) - row.drive[i];
    const L is_known = f.is_driven * larger(f.is_at_limit, exceeds);
    f.given = choose(is_known, known, zero) - a.limited * (one - f.is_at_limit) * row.hold[i];
    f.is_driven = f.is_driven * (one - is_known);
    drive[i] = row.drive[i] + choose(is_known, known, zero);
    hold[i] = row.hold[i] * (one - a.limited * (one - f.is_at_limit));
  }
  solve_free_axes(system, row, axes);
  for (int i = 0; i < axis_count; ++i) {
    const GenericAxis<L>& a = row.axes[i];
    const FreeAxis<L>& f = axes[i];
    const L change = system.wanted[i] * system.inverse[i];
    const L driven = bounded(row.drive[i] + change, a.most);
    drive[i] = choose(f.is_driven, reacts ? choose(is_less(zero, a.armature), row.drive[i] + change, driven) : driven,
                      drive[i]);
    // A lasting impulse is partly given back, as for locked axes.
    const L lasts = is_less(zero, larger(row.hold[i], zero - row.hold[i]));
    const L soft = mul_add(row.mass_scale * change, zero - row.impulse_scale, row.hold[i]);
    L held = row.hold[i] + choose(lasts, soft, change);
    held = choose(is_less(rows.value[i] - a.lower, a.upper - rows.value[i]), larger(held, zero), smaller(held, zero));
    if (reacts) {
      // Body and armature share what a soft limit lets through.
      const L short_by = f.is_at_limit * (row.hold[i] + change - held);
      drive[i] = mul_add(drive[i], a.armature / larger(system.inverse[i] + a.armature, splat<L>(1e-30f)), short_by);
    }
    hold[i] = choose(f.is_at_limit, held, hold[i]);
    const L soft_pull = system.pull[i] * system.inverse[i];
    pull[i] = choose(a.locked, row.mass_scale, choose(lasts, row.mass_scale, one)) * soft_pull;
    pull[i] =
        choose(f.is_at_limit, smaller(larger(pull[i], smaller(held, zero)), larger(held, zero)), pull[i] * a.locked);
  }
}

/// Applies the last step's impulses.
template <class L, class Bodies>
FATHOM_LANE_FUNCTION void warm_start_generic_joint(GenericJointRow<L>& row, Bodies& bodies) {
  GenericJointRows<L, Bodies>(row, bodies, splat<L>(0.0f)).carry_along(row, splat<L>(0.0f));
}

/// How an axis relaxes where it has armature or restitution.
template <class L>
struct RelaxingAxis {
  L spins, compliance;  ///< 1: only its armature holds it
  L of_armature;        ///< N·s of the armature where a limit holds the axis

  FATHOM_LANE_FUNCTION RelaxingAxis(const GenericJointRow<L>& row, int i, L presses, L& wanted) {
    const L zero = splat<L>(0.0f), one = splat<L>(1.0f);
    const GenericAxis<L>& a = row.axes[i];
    const L at_limit = a.limited * presses, has = is_less(zero, a.armature);
    spins = has * ((one - a.locked) * (one - at_limit));
    compliance = spins / larger(a.armature, splat<L>(1e-30f));
    of_armature = at_limit * a.armature * (row.rate[i] - row.bounce[i]);
    wanted = wanted + (spins * row.rate[i] + at_limit * row.bounce[i]);
  }
  /// The armature's share of a row's change.
  FATHOM_LANE_FUNCTION L part_of(L change) const { return mul_add(of_armature, spins, change); }
};

/// The relaxed impulse of an axis, in a system whose rows have been solved.
template <class L>
FATHOM_LANE_FUNCTION L relaxed_hold(const GenericJointRow<L>& row, int i, L change) {
  const L zero = splat<L>(0.0f), held = row.hold[i] + change;
  const L pressing = choose(is_less(row.hold[i], zero), smaller(held, zero), larger(held, zero));
  return choose(row.axes[i].limited, pressing, held);
}

/// Removes the velocity with which the last sweep pulled axes back to their limits: they have moved by it, or this
/// sweep finds how far they still are. Left in the velocities it would add energy at every hit of a limit, because the
/// relax sweep would remove it along rows that have turned.
template <class L, class Bodies>
FATHOM_LANE_FUNCTION void take_back_pull(GenericJointRow<L>& row, Bodies& bodies) {
  const auto frame_of = [](const auto& side) FATHOM_LANE_LAMBDA {
    return SpinFrame<L, Bodies::all_isotropic>(rotation_by<L>(side.turned), side);
  };
  frame_of(bodies.b).push(bodies.b, bodies.inverse_of_b(), negated<L>(row.pulled), negated<L>(row.pulled_b));
  if constexpr (!Bodies::only_pushes_b)
    frame_of(bodies.a).push(bodies.a, bodies.inverse_of_a(), row.pulled, row.pulled_a);
  row.pulled = row.pulled_a = row.pulled_b = zero_vector<L>();
}

/// One sweep of a substep of h seconds, like `solve_ball_joint`.
template <JointPass pass, class L, class Bodies>
FATHOM_LANE_FUNCTION L solve_generic_joint(GenericJointRow<L>& row, Bodies& bodies, L h, JointUse use,
                                           bool ends_substep) {
  constexpr bool relaxes = pass == JointPass::relax;
  const L zero = splat<L>(0.0f);
  constexpr bool splits = pass != JointPass::iterate;
  if (splits && use.moves) take_back_pull(row, bodies);
  GenericJointRows<L, Bodies> rows(row, bodies, h);
  L hold[axis_count], drive[axis_count], more[axis_count], pull_back[axis_count];
  if constexpr (!relaxes) rows.carry_along(row, h);
  GenericSystem<L> system;
  const L most = splat<L>(max_pull);
  for (int i = 0; i < axis_count; ++i) {
    const GenericAxis<L>& a = row.axes[i];
    const L pull = bounded(row.bias_rate * (rows.value[i] - a.lower), most);
    system.wanted[i] = zero - rows.velocity(i);
    if constexpr (!relaxes) system.wanted[i] = system.wanted[i] - a.locked * (rows.drift[i] + pull);
    system.pull[i] = zero - a.locked * pull;
    system.inverse[i] = zero;
    for (int j = 0; j <= i; ++j) system.response[i][j] = system.response[j][i] = rows.response(i, j);
  }
  const GenericSystem<L> before = system;
  for (int i = 0; i < axis_count; ++i) {
    const GenericAxis<L>& a = row.axes[i];
    hold[i] = row.hold[i], drive[i] = row.drive[i];
    L active = a.locked, compliance = zero;
    if constexpr (relaxes) {
      const L presses = is_less(zero, larger(row.hold[i], zero - row.hold[i]));
      active = larger(a.locked, a.limited * presses);
      if (use.reacts) {
        const RelaxingAxis<L> axis(row, i, presses, system.wanted[i]);
        active = larger(active, axis.spins), compliance = axis.compliance;
      }
      if (use.moves) {
        const L settling = is_tamed(row, bodies, i);
        active = larger(active, settling);
        compliance = choose(settling, settling_compliance(a.compliance, before.response[i][i]), compliance);
      }
    }
    if (!relaxes && use.moves)
      system.template eliminate<true>(i, active, compliance);
    else
      system.eliminate(i, active, compliance);
  }
  if (!relaxes && use.moves) drive_and_limit(system, before, row, rows, h, use.reacts, hold, drive, pull_back);
  for (int i = 0; i < axis_count; ++i) {
    const GenericAxis<L>& a = row.axes[i];
    L change = system.wanted[i] * system.inverse[i];
    if constexpr (relaxes) {
      if (use.reacts) {
        L unused = zero;
        const L presses = is_less(zero, larger(row.hold[i], zero - row.hold[i]));
        const L of_armature = RelaxingAxis<L>(row, i, presses, unused).part_of(change);
        drive[i] = drive[i] + of_armature;
        change = change - of_armature;
      }
      if (use.moves) {
        const L settling = is_tamed(row, bodies, i) * change;
        drive[i] = drive[i] + settling;
        change = change - settling;
      }
      hold[i] = relaxed_hold(row, i, change);
    } else {
      const L soft = mul_add(row.mass_scale * change, zero - row.impulse_scale, row.hold[i]);
      hold[i] = choose(a.locked, row.hold[i] + soft, hold[i]);
    }
    more[i] = (hold[i] - row.hold[i]) + (drive[i] - row.drive[i]);
  }
  const L share = rows.followed_share(more, h);
  const auto is_cut = is_above(splat<L>(1.0f), share);
  for (int i = 0; i < axis_count; ++i) {
    more[i] = share * more[i];
    row.hold[i] = select(is_cut, mul_add(row.hold[i], share, hold[i] - row.hold[i]), hold[i]);
    row.drive[i] = select(is_cut, mul_add(row.drive[i], share, drive[i] - row.drive[i]), drive[i]);
  }
  rows.push(row, more);
  if (pass == JointPass::soft && use.moves) rows.set_pull_apart(row, pull_back, share);
  // All of several sweeps per substep use the rates from its start.
  if (use.reacts && (pass != JointPass::iterate || ends_substep))
    for (int i = 0; i < axis_count; ++i) row.rate[i] = rows.velocity(i);
  if (ends_substep) rows.add_up(row);
  const VecOf<L> sum = (bodies.a.linear + bodies.a.angular) + (bodies.b.linear + bodies.b.angular) + row.given;
  return sum.x + (sum.y + sum.z);
}
