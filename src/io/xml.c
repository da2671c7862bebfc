#include "io/xml.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include <libxml/parserInternals.h>
#include <libxml/xmlerror.h>

#include "io/text.h"

/* libxml2 declares the handler with a const error from 2.12 on. */
#if LIBXML_VERSION >= 21200
typedef const xmlError *XmlErrorPtr;
#else
typedef xmlErrorPtr XmlErrorPtr;
#endif

static void on_error(void *context, XmlErrorPtr e)
{
    KellerXmlCapture *capture = context;
    if (!e || e->level < XML_ERR_ERROR) return;
    if (capture->errors++) return;
    capture->line = e->line > 0 ? e->line : 0;
    snprintf(capture->message, sizeof capture->message, "%s", e->message ? e->message : "unknown error");
    for (char *p = capture->message; *p; p++)
        if ((unsigned char)*p < ' ') *p = ' ';
    size_t length = strlen(capture->message);
    while (length && (capture->message[length - 1] == ' ' || capture->message[length - 1] == '.'))
        capture->message[--length] = '\0';
}

void keller_xml_capture_begin(KellerXmlCapture *capture)
{
    *capture = (KellerXmlCapture){.saved = xmlStructuredError, .saved_context = xmlStructuredErrorContext};
    xmlSetStructuredErrorFunc(capture, on_error);
}

void keller_xml_capture_end(KellerXmlCapture *capture)
{
    xmlSetStructuredErrorFunc(capture->saved_context, capture->saved);
}

int keller_xml_line(const void *node)
{
    const xmlNode *n = node;
    if (n && n->type == XML_ATTRIBUTE_NODE) n = n->parent;
    long line = n ? xmlGetLineNo(n) : 0;
    return line > 0 && line < INT32_MAX ? (int)line : 0;
}

/* Called at `<!DOCTYPE name`, before any declaration in it is read: nothing can be declared, so nothing can expand. */
static void refuse_doctype(void *context, const xmlChar *name, const xmlChar *external, const xmlChar *system)
{
    (void)name, (void)external, (void)system;
    xmlParserCtxtPtr parser = context;
    *(int *)parser->_private = xmlSAX2GetLineNumber(parser);
    xmlStopParser(parser);
}

KellerStatus keller_xml_read(const char *file, xmlDocPtr *doc, KellerError *error)
{
    *doc = NULL;
    char *text = NULL;
    size_t size = 0;
    struct stat st;
    if (stat(file, &st) == 0 && S_ISREG(st.st_mode) && st.st_size > (off_t)KELLER_XML_MAX_BYTES)
        return keller_error(error, KELLER_BAD_INPUT, "%s:1: the file has %lld bytes; expected at most %u MiB of XML",
                            file, (long long)st.st_size, KELLER_XML_MAX_BYTES >> 20);
    KellerStatus status = keller_text_load(file, NULL, &text, &size, error);
    if (status != KELLER_OK) return status;
    if (size == 0 || size > KELLER_XML_MAX_BYTES) {
        free(text);
        return keller_error(error, KELLER_BAD_INPUT, "%s:1: the file is empty or too large; expected an XML document",
                            file);
    }
    xmlInitParser();
    KellerXmlCapture capture;
    keller_xml_capture_begin(&capture);
    xmlParserCtxtPtr parser = xmlNewParserCtxt();
    if (!parser) {
        keller_xml_capture_end(&capture);
        free(text);
        return keller_error_memory(error, sizeof *parser);
    }
    int doctype_line = 0;
    parser->_private = &doctype_line;
    parser->sax->internalSubset = refuse_doctype;
    /* XML_PARSE_HUGE would lift the limits on depth and size, XML_PARSE_NOENT and _DTDLOAD would expand and load. */
    xmlDocPtr result = xmlCtxtReadMemory(parser, text, (int)size, file, NULL,
                                         XML_PARSE_NONET | XML_PARSE_NOCDATA | XML_PARSE_BIG_LINES);
    if (doctype_line > 0) {
        status =
            keller_error(error, KELLER_BAD_INPUT,
                         "%s:%d: a document type declaration (<!DOCTYPE ...>) is not accepted; expected a document "
                         "without one, and so without entities of its own",
                         file, doctype_line);
    } else if (!result || capture.errors) {
        int line = capture.line ? capture.line : 1;
        status = keller_error(error, KELLER_BAD_INPUT, "%s:%d: not well-formed XML: %s", file, line,
                              capture.errors ? capture.message : "the document could not be read");
    } else if (!xmlDocGetRootElement(result)) {
        status = keller_error(error, KELLER_BAD_INPUT, "%s:1: the XML document has no element", file);
    }
    xmlFreeParserCtxt(parser);
    keller_xml_capture_end(&capture);
    free(text);
    if (status != KELLER_OK) {
        if (result) xmlFreeDoc(result);
        return status;
    }
    *doc = result;
    return KELLER_OK;
}
