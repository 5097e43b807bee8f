#include "exec/sycl/sycl_device.hpp"
#include "limits_primitives.hpp"

namespace fathom::bench {

Limits register_sycl(int index) { return Primitives<SyclDevice>(std::make_shared<SyclDevice>(index)).add(); }

}  // namespace fathom::bench
