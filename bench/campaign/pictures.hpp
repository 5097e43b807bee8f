// Pictures of the environments at start, middle and end.
#pragma once

#include <functional>

#include "store.hpp"

namespace fathom::campaign {

/// Runs each environment that the campaign has once more, untimed, with each set of algorithms on the simulator that
/// showed it (Fathom's on the native one, the published on the device), and draws it. What is drawn already stays.
/// Nothing where this build or machine cannot draw. `go_on` false ends it early.
void draw_pictures(const Store& store, Campaign& campaign, const std::function<bool()>& go_on);

}  // namespace fathom::campaign
