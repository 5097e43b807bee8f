#include "device/simulator_queries.hpp"
#include "exec/host/host_device.hpp"

namespace fathom::device {

template bool DeviceSimulator<exec::HostDevice>::cast_rays(const ManyRays&, const TakeHits&) const;
template bool DeviceSimulator<exec::HostDevice>::cast_shapes(const ManyShapes&, const TakeHits&) const;
template bool DeviceSimulator<exec::HostDevice>::overlap_shapes(const ManyShapes&, const TakeTouched&) const;

}  // namespace fathom::device
