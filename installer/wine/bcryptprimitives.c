/* For tests only: Wine 8 lacks this library, of which cryptography asks random bytes. */
#define EXPORT __declspec(dllexport)

__declspec(dllimport) unsigned char __stdcall SystemFunction036(void *to, unsigned long n);

EXPORT int ProcessPrng(unsigned char *to, unsigned long long n)
{
    return SystemFunction036(to, (unsigned long)n);
}

int __stdcall DllMainCRTStartup(void *library, unsigned reason, void *more) { return 1; }
