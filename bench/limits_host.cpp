#include "exec/host/host_device.hpp"
#include "limits_primitives.hpp"

namespace fathom::bench {

Limits register_host(int threads) { return Primitives<HostDevice>(std::make_shared<HostDevice>(threads)).add(); }

}  // namespace fathom::bench
