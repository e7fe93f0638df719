"""A hint to the processor: this will be read soon."""

from typing import Any

from llvmlite import ir
from numba import config, types
from numba.core import cgutils
from numba.extending import intrinsic

# LLVM's arguments: for reading, to stay in all caches, data
_READ = 0
_KEEP = 3
_DATA = 1


def _prefetch(context: Any, array: Any, index: Any) -> Any:
    """Fetch the place of a one-dimensional contiguous array into the caches.

    For compiled code only.

    It changes nothing but the time of a later access, and an index beyond the array does no harm.
    """
    signature = types.void(array, index)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        pointer = ir.IntType(8).as_pointer()
        number = ir.IntType(32)
        kind = ir.FunctionType(ir.VoidType(), [pointer, number, number, number])
        function = cgutils.get_or_insert_function(  # type: ignore[no-untyped-call]
            builder.module, kind, "llvm.prefetch.p0i8"
        )
        place = builder.bitcast(builder.gep(data, [arguments[1]]), pointer)
        builder.call(function, [place, number(_READ), number(_KEEP), number(_DATA)])
        return context.get_dummy_value()

    return signature, generate


def _nothing(array: Any, index: Any) -> None:
    """In its place where numba is switched off."""


prefetch: Any = _nothing
if not config.DISABLE_JIT:  # type: ignore[attr-defined]
    prefetch = intrinsic(_prefetch)
