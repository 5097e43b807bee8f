#include "validate/setup.hpp"

namespace fathom::validate {

WorldDef world_def(const Setup& setup) {
  if (setup.simulator != "native")
    throw Error(ErrorCode::unavailable, "this build has no simulator '" + setup.simulator + "'; use native");
  WorldDef def;
  def.threads = setup.threads;
  def.sleep.enabled = false;
  return def;
}

}  // namespace fathom::validate
