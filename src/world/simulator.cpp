#include "world/simulator.hpp"

#include "dynamics/forces.hpp"
#include "world/validate.hpp"

namespace fathom {

void Simulator::add_velocity(std::uint32_t slot, const Velocity& change) {
  const Velocity now = velocities()[slot];
  const Velocity next{now.linear + change.linear, 0, now.angular + change.angular, 0};
  check_finite(next.linear, "add velocity", "the resulting velocity");
  check_finite(next.angular, "add velocity", "the resulting angular velocity");
  set_velocity(slot, next);
}

// Impulses act at once, on dynamic bodies only: Δv = P/m, Δω = I⁻¹·L.
void Simulator::add_impulse(std::uint32_t slot, const Velocity& impulse) {
  const BodyInfo& info = bodies[slot];
  Velocity v = velocities()[slot];
  const Quat q = poses()[slot].rotation;
  v.linear = mul_add(v.linear, info.inverse_mass, impulse.linear);
  v.angular +=
      angular_response(q, info.isotropic ? info.inverse_inertia.xx : 0.0f, info.inverse_inertia, impulse.angular);
  check_finite(v.linear, "apply impulse", "the resulting velocity");
  check_finite(v.angular, "apply impulse", "the resulting angular velocity");
  set_velocity(slot, v);
}

void Simulator::for_each_contact_of(std::uint32_t slot, const std::function<void(const ContactInfo&)>& visit) {
  for_each_contact([&](const ContactInfo& contact) {
    if (contact.a.index == slot || contact.b.index == slot) visit(contact);
  });
}

// The first thread refreshes while others wait: a thread that sees the flag sees the refreshed data.
std::span<const Pose> Simulator::prepare_queries() const {
  callbacks.check_not_called("query");
  if (!queries_are_current_.load(std::memory_order_acquire)) {
    const std::lock_guard lock(refreshing_);
    if (!queries_are_current_.load(std::memory_order_relaxed)) {
      queried_poses_ = const_cast<Simulator*>(this)->refresh_queries();
      queries_are_current_.store(true, std::memory_order_release);
    }
  }
  return queried_poses_;
}

}  // namespace fathom
