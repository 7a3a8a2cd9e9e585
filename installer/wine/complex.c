/* For tests only: C99 complex functions that Debian's Wine leaves out of the Universal C
   Runtime. There, complex numbers are structures of two doubles (or floats), and long
   doubles have 64 bits; on 64-bit Windows gcc passes its own complex types likewise. */
#include <complex.h>

typedef double _Complex D;
typedef float _Complex F;

#define COMPLEX(name)                            \
    D s_##name(D z) { return name(z); }          \
    F s_##name##f(F z) { return name##f(z); }    \
    D s_##name##l(D z) { return name(z); }
#define REAL(name)                               \
    double s_##name(D z) { return name(z); }     \
    float s_##name##f(F z) { return name##f(z); } \
    double s_##name##l(D z) { return name(z); }

COMPLEX(cacos) COMPLEX(cacosh) COMPLEX(casin) COMPLEX(casinh) COMPLEX(catan)
COMPLEX(catanh) COMPLEX(ccos) COMPLEX(ccosh) COMPLEX(cexp) COMPLEX(clog) COMPLEX(conj)
COMPLEX(cproj) COMPLEX(csin) COMPLEX(csinh) COMPLEX(csqrt) COMPLEX(ctan) COMPLEX(ctanh)
REAL(cabs) REAL(carg) REAL(cimag) REAL(creal)

D s_cpow(D a, D b) { return cpow(a, b); }
F s_cpowf(F a, F b) { return cpowf(a, b); }
D s_cpowl(D a, D b) { return cpow(a, b); }
