#include "world/callbacks.hpp"

#include <string>
#include <utility>

#include "world/validate.hpp"

namespace fathom {

template <class Call>
void Callbacks::call(const Call& act) {
  is_called_ = true;
  try {
    act();
  } catch (...) {
    if (!error_) error_ = std::current_exception();
  }
  is_called_ = false;
}

void Callbacks::ask(PreSolveContact& contact) {
  call([&] {
    PreSolveContact changed = contact;
    pre_solve(changed);
    const Material as_material{
        .friction = changed.friction, .restitution = changed.restitution, .surface_velocity = changed.surface_velocity};
    check_material(as_material, "pre-solve callback");
    contact.enabled = changed.enabled;
    contact.friction = changed.friction;
    contact.restitution = changed.restitution;
    contact.surface_velocity = changed.surface_velocity;
  });
}

bool Callbacks::lets_collide(BodyId a, BodyId b) {
  bool may_collide = true;
  call([&] { may_collide = filter(a, b); });
  return may_collide;
}

void Callbacks::check_not_called(const char* action) const {
  if (is_called_)
    throw Error(ErrorCode::invalid_argument, std::string(action) +
                                                 ": the world is in the middle of a step, and its callbacks must not "
                                                 "change, save or query it; note it and do it after the step");
}

void Callbacks::rethrow() {
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
}

}  // namespace fathom
