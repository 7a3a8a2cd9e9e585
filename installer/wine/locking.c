/* For tests only: where a lock is refused, Wine's C runtime does not say by errno why. */
#include <errno.h>
#include <windows.h>

#define REAL(name) GetProcAddress(LoadLibraryA("ucrtwine.dll"), name)

int s__locking(int file, int mode, long n_bytes)
{
    int (*locking)(int, int, long) = (void *)REAL("_locking");
    int *(*number)(void) = (void *)REAL("_errno");
    int status = locking(file, mode, n_bytes);

    if (status)
        *number() = EACCES;
    return status;
}
