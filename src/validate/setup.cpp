#include "validate/setup.hpp"

namespace fathom::validate {

WorldDef world_def(const Setup& setup) {
  WorldDef def;
  def.simulator = setup.simulator;
  def.device = setup.device;
  def.threads = setup.threads;
  def.sleep.enabled = false;
  return def;
}

}  // namespace fathom::validate
