#include "device/simulator_queries.hpp"
#include "exec/sycl/sycl_device.hpp"

namespace fathom::device {

template bool DeviceSimulator<exec::SyclDevice>::cast_rays(const ManyRays&, const TakeHits&) const;
template bool DeviceSimulator<exec::SyclDevice>::cast_shapes(const ManyShapes&, const TakeHits&) const;
template bool DeviceSimulator<exec::SyclDevice>::overlap_shapes(const ManyShapes&, const TakeTouched&) const;

}  // namespace fathom::device
