/* For tests only: stands in for Windows' own ICU, which Wine lacks. Qt asks it for text
   encodings that Qt itself does not know; every opening fails as a missing one does. */
#define EXPORT __declspec(dllexport)
#define FILE_ACCESS_ERROR 4

static void refuse(int *error)
{
    if (error)
        *error = FILE_ACCESS_ERROR;
}

EXPORT void *ucnv_open(const char *name, int *error) { refuse(error); return 0; }
EXPORT void ucnv_close(void *converter) {}
EXPORT void ucnv_reset(void *converter) {}
EXPORT void UCNV_FROM_U_CALLBACK_SUBSTITUTE(void) {}
EXPORT void UCNV_TO_U_CALLBACK_SUBSTITUTE(void) {}
EXPORT signed char ucnv_getMaxCharSize(void *converter) { return 1; }
EXPORT const char *ucnv_getName(void *converter, int *error) { refuse(error); return ""; }
EXPORT void ucnv_getToUCallBack(void *a, void **b, void **c) {}
EXPORT void ucnv_getFromUCallBack(void *a, void **b, void **c) {}
EXPORT void ucnv_setToUCallBack(void *a, void *b, void *c, void *d, void *e, int *f) {}
EXPORT void ucnv_setFromUCallBack(void *a, void *b, void *c, void *d, void *e, int *f) {}
EXPORT void ucnv_cbToUWriteUChars(void *a, void *b, int c, int d, int *e) { refuse(e); }
EXPORT void ucnv_cbFromUWriteUChars(void *a, void *b, int c, int d, int *e) { refuse(e); }
EXPORT void ucnv_toUnicode(void *a, void *b, void *c, void *d, void *e, void *f, int g,
                           int *error) { refuse(error); }
EXPORT void ucnv_fromUnicode(void *a, void *b, void *c, void *d, void *e, void *f, int g,
                             int *error) { refuse(error); }
EXPORT int ucnv_toUCountPending(void *a, int *error) { refuse(error); return 0; }
EXPORT int ucnv_fromUCountPending(void *a, int *error) { refuse(error); return 0; }
EXPORT const char *ucnv_getStandardName(const char *a, const char *b, int *error)
{
    refuse(error);
    return 0;
}
EXPORT const char *ucnv_getAvailableName(int number) { return 0; }
EXPORT int ucnv_countAvailable(void) { return 0; }

int __stdcall DllMainCRTStartup(void *library, unsigned reason, void *more) { return 1; }
